//! What things are called in files of the original platform, then and now.
//!
//! Its metamodel was renamed over the years (attacks became operations, topics variables), and files were never
//! converted. Here old names become the last ones, and everything that is not carried over is counted by name.

use std::collections::BTreeMap;

use crate::xml::{Element, printable};

/// Old names of elements and attributes beside the last ones.
const RENAMED: [(&str, &str); 12] = [
    ("possibleAttacks", "possibleFuzzingOperations"),
    ("attacks", "operations"),
    ("includedAttacks", "includedOperations"),
    ("attackActivation", "activation"),
    ("topicToAttack", "variableToAffect"),
    ("topics", "variables"),
    ("relatedTopics", "relatedVariables"),
    ("default", "valueIfNotReceived"),
    ("includeInOptimisation", "useInOptimisation"),
    ("AttackFixedTime", "FixedTimeActivation"),
    ("AttackTimesMetric", "FuzzingOperationTimesMetric"),
    ("EventBasedVariable", "Variable"),
];

/// Elements and attributes that are read.
const READ: [&str; 83] = [
    "name",
    "dir",
    "relatedVariables",
    "valueIfNotReceived",
    "initValue",
    "defaultVal",
    "useInOptimisation",
    "metrics",
    "metric",
    "result",
    "value",
    "chosenVariables",
    "possibleFuzzingOperations",
    "operations",
    "activation",
    "startTime",
    "endTime",
    "starting",
    "ending",
    "length",
    "c",
    "left",
    "right",
    "binop",
    "bincomp",
    "variableToAffect",
    "fromTemplate",
    "recordedTimings",
    "seed",
    "priority",
    "inclusionProbability",
    "conditionConstraints",
    "minValue",
    "maxValue",
    "isRelative",
    "valueSet",
    "propertyName",
    "lowerBound",
    "upperBound",
    "minPoint",
    "maxPoint",
    "x",
    "y",
    "z",
    "choices",
    "location",
    "latency",
    "randomised",
    "frequency",
    "params",
    "campaigns",
    "conditionMetrics",
    "activationGeneration",
    "conditionDepth",
    "includedOperations",
    "approach",
    "populationSize",
    "iterations",
    "coveragePerCell",
    "targetCoverageProportion",
    "dimensionRecords",
    "dimID",
    "count",
    "extraData",
    "testToRepeat",
    "repeatCount",
    "performedTests",
    "developedFrom",
    "resultSets",
    "status",
    "results",
    "endTrigger",
    "timeLimitSeconds",
    "mrs",
    "variables",
    "type",
    "nodes",
    "subscriber",
    "publisher",
    "simulator",
    "hostname",
    "port",
    "propertyType",
];

/// Elements and attributes that are read for what they say of others, or that say nothing.
const BESIDE: [&str; 14] = [
    "id",
    "version",
    "schemaLocation",
    "parsingMethod",
    "parameters",
    "subparameters",
    "stepSizeMillis",
    "streams",
    "parentCampaign",
    "containingTest",
    "sequenceNumInTest",
    "maximumActivations",
    "operationTime",
    "TestingSpace",
];

/// How a file speaks, as far as it was read.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Dialect {
    /// Old names that were met, with what they are called since, and how often.
    pub renamed: BTreeMap<(String, String), usize>,
    /// Elements and attributes that are not carried over, and how often they were met.
    pub left_out: BTreeMap<String, usize>,
}

impl Dialect {
    /// Gives an element with all that is in it its last names.
    pub(crate) fn settle(&mut self, element: &mut Element) {
        self.rename(&mut element.tag);
        self.count(&element.tag);
        if let Some(kind) = &mut element.kind {
            self.rename(kind);
        }
        let known_by_hand = READ.contains(&element.tag.as_str()) || BESIDE.contains(&element.tag.as_str());
        for (name, _) in &mut element.attributes {
            self.rename(name);
            if known_by_hand {
                self.count(name);
            }
        }
        // What is in an element that is left out is left out with it.
        if known_by_hand {
            for child in &mut element.children {
                self.settle(child);
            }
        }
    }

    fn rename(&mut self, name: &mut String) {
        let since = match RENAMED.iter().find(|(old, _)| old == name) {
            Some((_, since)) => (*since).to_owned(),
            // `RandomValueFromSetAttack` is the operation of that name.
            None => match name.strip_suffix("Attack") {
                Some("Custom") => "CustomFuzzingOperation".to_owned(),
                Some(stem) if !stem.is_empty() => format!("{stem}Operation"),
                _ => return,
            },
        };
        *self.renamed.entry((name.clone(), since.clone())).or_default() += 1;
        *name = since;
    }

    /// Why something is not carried over.
    pub(crate) fn why(name: &str) -> &'static str {
        match name {
            "useMutationEnhancingCoverage" | "coverageBoostingStrategy" => "coverage is not boosted in this version",
            "launchFileLocation" | "launchDelaySeconds" | "customTerminateFileLocation" | "recordFileLocation" => {
                "how a simulator is started is said in its own line"
            }
            "res" => "the values of a metric are in the results",
            "execStrategy" => "workers are a matter of each run",
            "includeInTiming" => "every operation counts",
            "customProcessClass" => "its code is to be written in Rust",
            _ => "there is nothing like it",
        }
    }

    fn count(&mut self, name: &str) {
        if !READ.contains(&name) && !BESIDE.contains(&name) {
            *self.left_out.entry(printable(name)).or_default() += 1;
        }
    }
}
