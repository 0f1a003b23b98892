//! What things are called in files of the original platform, then and now.
//!
//! Its metamodel was renamed over the years (attacks became operations, topics variables), and files were never
//! converted. Here old names become the last ones, and everything that is not carried over is counted by name.

use std::collections::BTreeMap;

use crate::xml::{Element, printable};

/// Old names of elements and attributes with the last ones.
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
const READ: [&str; 90] = [
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
    "includeInTiming",
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
    "coverageBoostingStrategy",
    "useMutationEnhancingCoverage",
    "useBoostingOnceEveryGenerations",
    "useBoostingOnceEveryIterations",
    "startingBoostingCount",
    "endingBoostingCount",
    "countDropEveryGeneration",
    "dimensionRecords",
    "dimID",
    "count",
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

/// Elements and attributes that are not carried over, why, and what the language has to do with it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LeftOut {
    /// What files call them.
    pub names: &'static [&'static str],
    /// What an import says of them.
    pub why: &'static str,
    /// Words of the language that take their place. The sentence is wrong if the language does not have them.
    pub has: &'static [&'static str],
    /// Words that the language would have if it could say this. The sentence is wrong once the language has them.
    pub lacks: &'static [&'static str],
}

/// What an import says of a name that is in no list here.
const UNKNOWN: &str = "imports do not know what it means";

/// All that files of the original platform may hold and imports do not carry over.
pub const LEFT_OUT: [LeftOut; 12] = [
    LeftOut {
        names: &["launchFileLocation", "launchDelaySeconds", "customTerminateFileLocation"],
        why: "the line of the simulator says how it is started, and `launch` and `terminate` say what else is",
        has: &["launch", "terminate"],
        lacks: &[],
    },
    LeftOut {
        names: &["recordFileLocation"],
        why: "`record mcap` in a campaign records its messages",
        has: &["record", "mcap"],
        lacks: &[],
    },
    LeftOut { names: &["res"], why: "the values of a metric are in the results", has: &[], lacks: &["sink", "csv"] },
    LeftOut {
        names: &["execStrategy"],
        why: "workers are a matter of each run",
        has: &[],
        lacks: &["workers", "distribute"],
    },
    LeftOut {
        names: &["customProcessClass"],
        why: "its code is to be written in Rust",
        has: &["custom"],
        lacks: &["java", "class"],
    },
    LeftOut {
        names: &["extraData"],
        why: "the cells of P1 and P2 count all parameters of a test",
        has: &["coverage"],
        lacks: &["parameter_of", "value_set"],
    },
    LeftOut {
        names: &["fromNodes", "toNodes", "messagesFromAllComponenents", "messagesToAllComponenents"],
        why: "the original never used it; here `from` and `to` limit an operation to the messages of certain nodes",
        has: &["from", "to"],
        lacks: &[],
    },
    LeftOut {
        names: &["nodeToFuzz"],
        why: "the original never used it; here an operation can act `on node`",
        has: &["on", "node"],
        lacks: &[],
    },
    LeftOut {
        names: &["debugFlags"],
        why: "a campaign that is `passive` only observes",
        has: &["passive"],
        lacks: &[],
    },
    LeftOut {
        names: &["useStepping"],
        why: "the `step` in the line of the simulator says whether it is stepped",
        has: &["step"],
        lacks: &[],
    },
    LeftOut {
        names: &["useGUI"],
        why: "how a simulator shows itself is a matter of its own settings",
        has: &[],
        lacks: &["gui", "headless"],
    },
    LeftOut {
        names: &[
            "allPublishingVars",
            "publishingVars",
            "allSubscribingVars",
            "subscribingVars",
            "propertyToAffect",
            "subProperty",
            "subParameters",
            "properties",
            "property",
        ],
        why: "the original never used it",
        has: &[],
        lacks: &[],
    },
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
        LEFT_OUT.iter().find(|left| left.names.contains(&name)).map_or(UNKNOWN, |left| left.why)
    }

    fn count(&mut self, name: &str) {
        if !READ.contains(&name) && !BESIDE.contains(&name) {
            *self.left_out.entry(printable(name)).or_default() += 1;
        }
    }
}
