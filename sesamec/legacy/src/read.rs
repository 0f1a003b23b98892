//! From a file to an [`Original`], campaign by campaign and test by test: only one of them is ever in memory as XML.

use std::fs::File;
use std::path::Path;

use crate::original::{
    Activation, ActivationMode, Approach, Boosting, Campaign, Comparison, Condition, Constraint, Coverage, Domain,
    FieldOfType, Measured, Metric, MetricSource, Node, Operand, Operation, OperationKind, Original, Reference,
    ResultSet, Simulator, Target, Test, TypeOfValue, ValueSet,
};
use crate::xml::{Broken, Element, Source, Step, printable};

/// Reads a file; what is wrong in it is reported under this path.
pub(crate) fn read(path: &Path, file: File) -> Result<Original, Broken> {
    let mut source = Source::new(path, file);
    let mut original = Original::default();
    match source.next()? {
        Step::Open(root) if root.tag == "TestingSpace" => {
            root.get("name").unwrap_or_default().clone_into(&mut original.name);
        }
        Step::Open(root) => {
            let tag = printable(&root.tag);
            return Err(source.broken(format!(
                "this is not a testing space of the original platform: it begins with `{tag}`, not with `TestingSpace`"
            )));
        }
        Step::Close | Step::End => {
            return Err(
                source.broken("there is nothing in it; a testing space of the original platform is an XMI file")
            );
        }
    }
    loop {
        match source.next()? {
            Step::Open(element) if element.tag == "campaigns" => campaign(&mut source, &mut original, element)?,
            Step::Open(element) => {
                let mut element = source.whole(element)?;
                original.dialect.settle(&mut element);
                part(&mut original, &element).map_err(|what| source.broken(what))?;
            }
            Step::Close => break,
            Step::End => unreachable!("the root is closed before the file ends"),
        }
    }
    match source.next()? {
        Step::End => {}
        Step::Open(_) | Step::Close => return Err(source.broken("something follows after the testing space")),
    }
    original.references.name_metrics(&original.metrics);
    Ok(original)
}

/// A part of the space other than a campaign.
fn part(original: &mut Original, element: &Element) -> Result<(), String> {
    let define = |original: &mut Original, element: &Element, target| {
        if let Some(id) = element.get("id") {
            original.references.define(id, target);
        }
    };
    match element.tag.as_str() {
        "metrics" => {
            define(original, element, Target::Metric(original.metrics.len()));
            let metric = metric(original, element)?;
            original.metrics.push(metric);
        }
        "possibleFuzzingOperations" => {
            define(original, element, Target::Operation(original.operations.len()));
            let operation = operation(original, element)?;
            original.operations.push(operation);
        }
        "mrs" => {
            for child in &element.children {
                match child.tag.as_str() {
                    "variables" => {
                        define(original, child, Target::Variable(original.system.variables.len()));
                        let ty = reference(original, child, "type");
                        let name = child.get("name").unwrap_or_default().to_owned();
                        original.system.variables.push((name, ty));
                    }
                    "propertyType" => {
                        define(original, child, Target::Type(original.system.types.len()));
                        let ty = TypeOfValue {
                            name: child.get("name").unwrap_or_default().to_owned(),
                            text: child.get("parsingMethod") == Some("STRING"),
                            fields: fields(original, child, "parameters"),
                        };
                        original.system.types.push(ty);
                    }
                    "nodes" => {
                        let node = Node {
                            name: child.get("name").unwrap_or_default().to_owned(),
                            publishes: references(original, child, "publisher"),
                            subscribes: references(original, child, "subscriber"),
                        };
                        original.system.nodes.push(node);
                    }
                    "simulator" => original.system.simulator = Some(simulator(child)?),
                    _ => {}
                }
            }
        }
        _ => {}
    }
    Ok(())
}

fn simulator(element: &Element) -> Result<Simulator, String> {
    let (host, port) = (element.get("hostname").unwrap_or_default(), element.get("port").unwrap_or_default());
    let kind = element.kind.clone().unwrap_or_default();
    let step_ms = if kind == "TTSSimulator" { Some(number(element, "stepSizeMillis", 20.0)?) } else { None };
    let address = if port.is_empty() { host.to_owned() } else { format!("{host}:{port}") };
    Ok(Simulator { kind, address, step_ms })
}

fn fields(original: &mut Original, element: &Element, tag: &str) -> Vec<FieldOfType> {
    let mut found = Vec::new();
    for child in element.children.iter().filter(|child| child.tag == tag) {
        found.push(FieldOfType {
            name: child.get("name").unwrap_or_default().to_owned(),
            ty: reference(original, child, "type"),
            fields: fields(original, child, "subparameters"),
        });
    }
    found
}

/// A campaign, test by test.
fn campaign(source: &mut Source, original: &mut Original, mut opened: Element) -> Result<(), Broken> {
    original.dialect.settle(&mut opened);
    let at = original.campaigns.len();
    let mut campaign = Campaign {
        name: opened.get("name").unwrap_or_default().to_owned(),
        metrics: references(original, &opened, "metrics"),
        condition_metrics: references(original, &opened, "conditionMetrics"),
        included: references(original, &opened, "includedOperations"),
        ..Campaign::default()
    };
    loop {
        let mut child = match source.next()? {
            Step::Open(child) => source.whole(child)?,
            Step::Close => break,
            Step::End => unreachable!("the root is closed before the file ends"),
        };
        original.dialect.settle(&mut child);
        member(original, &mut campaign, at, &child).map_err(|what| source.broken(what))?;
    }
    original.campaigns.push(campaign);
    Ok(())
}

fn member(original: &mut Original, campaign: &mut Campaign, at: usize, element: &Element) -> Result<(), String> {
    match element.tag.as_str() {
        "performedTests" => {
            if let Some(id) = element.get("id") {
                original.references.define(id, Target::Test(at, campaign.tests.len()));
            }
            let test = test(original, element)?;
            campaign.tests.push(test);
        }
        "resultSets" => campaign.sets.push(ResultSet {
            name: element.get("name").unwrap_or_default().to_owned(),
            last: element.get("status") != Some("INTERMEDIATE"),
            members: references(original, element, "results"),
        }),
        "activationGeneration" => {
            campaign.activation = match element.kind.as_deref() {
                Some("ConditionBasedActivationGenerationMethod") => {
                    Some(ActivationMode::Condition { depth: count(element, "conditionDepth")? })
                }
                Some("TimeBasedActivationGenerationMethod") => Some(ActivationMode::Time),
                _ => None,
            };
        }
        "approach" => campaign.approach = approach(original, element)?,
        "endTrigger" if element.kind.as_deref() == Some("TimeBasedEnd") => {
            campaign.limit = Some(number(element, "timeLimitSeconds", 0.0)?);
        }
        _ => {}
    }
    Ok(())
}

fn approach(original: &mut Original, element: &Element) -> Result<Approach, String> {
    let kind = element.kind.as_deref().unwrap_or_default();
    Ok(match kind {
        "RandomTestGeneration" => Approach::Random,
        "RepeatedExecution" => Approach::Repeat {
            test: reference(original, element, "testToRepeat"),
            times: count(element, "repeatCount")?,
        },
        "NSGAEvolutionaryAlgorithm" | "NSGAWithCoverageCells" => {
            let coverage = if kind == "NSGAWithCoverageCells" {
                let mut dimensions = Vec::new();
                for record in element.children.iter().filter(|child| child.tag == "dimensionRecords") {
                    dimensions.push((
                        record.get("dimID").unwrap_or("T1_TIME_MIDPOINT_MEAN").to_owned(),
                        number(record, "minValue", 0.0)?,
                        number(record, "maxValue", 0.0)?,
                        count(record, "count")?,
                    ));
                }
                Some(Coverage {
                    hits: count(element, "coveragePerCell")?,
                    target: number(element, "targetCoverageProportion", 0.0)?,
                    dimensions,
                })
            } else {
                None
            };
            let (population, evaluations) = (count(element, "populationSize")?, count(element, "iterations")?);
            Approach::Nsga { population, evaluations, coverage, boosting: boosting(element)? }
        }
        _ => Approach::Missing,
    })
}

/// How an approach boosts coverage. Older files only say that it does.
fn boosting(element: &Element) -> Result<Option<Boosting>, String> {
    let Some(strategy) = element.children.iter().find(|child| child.tag == "coverageBoostingStrategy") else {
        let boosts = element.get("useMutationEnhancingCoverage") == Some("true");
        return Ok(boosts.then_some(Boosting::Unstated));
    };
    let every = |name: &str| if strategy.get(name).is_some() { count(strategy, name) } else { Ok(2) };
    let generations = every("useBoostingOnceEveryGenerations")?;
    Ok(Some(match strategy.kind.as_deref().unwrap_or_default() {
        "FixedNSGACoverageBoostingStrategy" => {
            Boosting::Fixed { generations, parents: every("useBoostingOnceEveryIterations")? }
        }
        "LinearNSGACoverageBoostingStrategy" => Boosting::Linear {
            generations,
            first: count(strategy, "startingBoostingCount")?,
            last: count(strategy, "endingBoostingCount")?,
            drop: count(strategy, "countDropEveryGeneration")?,
        },
        other => Boosting::Other(other.into()),
    }))
}

fn test(original: &mut Original, element: &Element) -> Result<Test, String> {
    let mut test = Test {
        name: element.get("name").unwrap_or_default().into(),
        parents: references(original, element, "developedFrom"),
        ..Test::default()
    };
    for child in &element.children {
        match child.tag.as_str() {
            "operations" => test.operations.push(operation(original, child)?),
            "metrics" => match child.children.iter().find(|part| part.tag == "result") {
                Some(result) => test.values.push(Measured {
                    metric: reference(original, child, "metric"),
                    name: result.get("name").map(|name| original.references.of_name(name)),
                    value: loose_number(result, "value", 0.0)?,
                }),
                None => test.without_value += 1,
            },
            _ => {}
        }
    }
    test.operations.shrink_to_fit();
    test.values.shrink_to_fit();
    Ok(test)
}

fn metric(original: &mut Original, element: &Element) -> Result<Metric, String> {
    let value = |tag: &str| -> Result<Option<f64>, String> {
        let child = element.children.iter().find(|child| child.tag == tag);
        child.map(|child| number(child, "defaultVal", 0.0)).transpose()
    };
    let mut related = references(original, element, "relatedVariables");
    related.extend(reference(original, element, "chosenVariables"));
    Ok(Metric {
        name: element.get("name").unwrap_or_default().to_owned(),
        source: match element.kind.as_deref() {
            Some("FuzzingOperationTimesMetric") => MetricSource::FuzzingTime,
            Some("StartEndTimingMetric") => MetricSource::Timing,
            _ => MetricSource::Code,
        },
        highest: element.get("dir") != Some("LOWEST"),
        related,
        default: value("valueIfNotReceived")?,
        initial: value("initValue")?,
        optimised: element.get("useInOptimisation") == Some("true"),
    })
}

fn operation(original: &mut Original, element: &Element) -> Result<Operation, String> {
    let kind = match element.kind.as_deref().unwrap_or_default() {
        "RandomValueFromSetOperation" => OperationKind::RandomValue {
            relative: element.get("isRelative") == Some("true"),
            values: value_sets(element, "valueSet")?,
        },
        "PacketLossNetworkOperation" => OperationKind::PacketLoss { keep: bounds(element, "frequency")? },
        "LatencyNetworkOperation" => OperationKind::Latency {
            delay: bounds(element, "latency")?,
            randomised: element.get("randomised") == Some("true"),
        },
        "BlackholeNetworkOperation" => OperationKind::Blackhole,
        "CustomFuzzingOperation" => OperationKind::Custom { parameters: value_sets(element, "params")? },
        other => OperationKind::Other(other.into()),
    };
    let activation = match element.children.iter().find(|child| child.tag == "activation") {
        None => Activation::Missing,
        Some(found) => match found.kind.as_deref() {
            Some("FixedTimeActivation") => {
                Activation::Time(number(found, "startTime", 0.0)?, number(found, "endTime", 0.0)?)
            }
            Some("ConditionBasedActivation") => {
                Activation::Condition(condition(original, found, "starting")?, condition(original, found, "ending")?)
            }
            Some("ConditionBasedTimeLimited") => {
                Activation::ConditionFor(condition(original, found, "starting")?, number(found, "length", 0.0)?)
            }
            _ => Activation::Missing,
        },
    };
    let recorded = element.children.iter().find(|child| child.tag == "recordedTimings");
    let recorded = recorded
        .map(|timings| Ok::<_, String>((number(timings, "startTime", 0.0)?, number(timings, "endTime", 0.0)?)))
        .transpose()?;
    let mut constraints = Vec::new();
    for child in element.children.iter().filter(|child| child.tag == "conditionConstraints") {
        match child.kind.as_deref() {
            Some("ContainsVariable") => {
                constraints.extend(reference(original, child, "metric").map(Constraint::Metric));
            }
            Some("ContainsInteger") => {
                constraints.push(Constraint::Integer(integer(child, "minValue")?, integer(child, "maxValue")?));
            }
            _ => {}
        }
    }
    Ok(Operation {
        name: element.get("name").unwrap_or_default().into(),
        kind,
        activation,
        variable: reference(original, element, "variableToAffect"),
        template: reference(original, element, "fromTemplate"),
        recorded,
        seed: integer(element, "seed")?,
        priority: i32::try_from(integer(element, "priority")?).unwrap_or(0),
        inclusion: number(element, "inclusionProbability", 1.0)?,
        timed: element.get("includeInTiming") != Some("false"),
        constraints,
    })
}

/// The range that a child of an element holds; nothing is a range from 0 to 0.
fn bounds(element: &Element, tag: &str) -> Result<(f64, f64), String> {
    match element.children.iter().find(|child| child.tag == tag) {
        Some(range) => Ok((number(range, "lowerBound", 0.0)?, number(range, "upperBound", 0.0)?)),
        None => Ok((0.0, 0.0)),
    }
}

fn value_sets(element: &Element, tag: &str) -> Result<Vec<ValueSet>, String> {
    let corner = |set: &Element, tag: &str| -> Result<[f64; 3], String> {
        match set.children.iter().find(|child| child.tag == tag) {
            Some(point) => Ok([number(point, "x", 0.0)?, number(point, "y", 0.0)?, number(point, "z", 0.0)?]),
            None => Ok([0.0; 3]),
        }
    };
    let mut sets = Vec::new();
    for set in element.children.iter().filter(|child| child.tag == tag) {
        let domain = match set.kind.as_deref().unwrap_or_default() {
            "DoubleRange" => Domain::Reals(number(set, "lowerBound", 0.0)?, number(set, "upperBound", 0.0)?),
            "IntRange" => Domain::Integers(integer(set, "lowerBound")?, integer(set, "upperBound")?),
            "PointRange" => Domain::Points(corner(set, "minPoint")?, corner(set, "maxPoint")?),
            "StringSet" => {
                let listed = set.attributes.iter().filter(|(name, _)| name == "choices").map(|(_, text)| text);
                let nested = set.children.iter().filter(|child| child.tag == "choices").map(|child| &child.text);
                Domain::Texts(nested.chain(listed).map(|text| text.as_str().into()).collect())
            }
            "ExternalResourceSet" => Domain::Texts(set.get("location").into_iter().map(Into::into).collect()),
            other => Domain::Other(other.into()),
        };
        sets.push(ValueSet { name: set.get("propertyName").unwrap_or_default().into(), domain });
    }
    Ok(sets)
}

/// The condition in a child of an activation.
fn condition(original: &mut Original, activation: &Element, tag: &str) -> Result<Option<Condition>, String> {
    let Some(holder) = activation.children.iter().find(|child| child.tag == tag) else { return Ok(None) };
    let Some(element) = holder.children.iter().find(|child| child.tag == "c") else { return Ok(None) };
    condition_of(original, element).map(Some)
}

// As deep as the element is, which the reader bounds.
fn condition_of(original: &mut Original, element: &Element) -> Result<Condition, String> {
    let side = |tag: &str| {
        element.children.iter().find(|child| child.tag == tag).ok_or_else(|| format!("a condition has no `{tag}` side"))
    };
    let (left, right) = (side("left")?, side("right")?);
    if element.kind.as_deref() == Some("CompositeCondition") {
        let left = Box::new(condition_of(original, left)?);
        let right = Box::new(condition_of(original, right)?);
        return Ok(if element.get("binop") == Some("OR") {
            Condition::Or(left, right)
        } else {
            Condition::And(left, right)
        });
    }
    let mut metric = |element: &Element| {
        reference(original, element, "metric").ok_or_else(|| "a condition compares no metric".to_owned())
    };
    let variable = metric(left)?;
    let by = match element.get("bincomp") {
        Some("GREATER_THAN") => Comparison::Greater,
        Some("EQUALS") => Comparison::Equal,
        _ => Comparison::Less,
    };
    let operand = match right.kind.as_deref() {
        Some("ConditionInteger") => Operand::Integer(integer(right, "value")?),
        _ => Operand::Metric(metric(right)?),
    };
    Ok(Condition::Compare(variable, by, operand))
}

/// The references in an attribute: ids or paths, apart by spaces.
fn references(original: &mut Original, element: &Element, name: &str) -> Vec<Reference> {
    let texts = element.get(name).unwrap_or_default().split_whitespace();
    texts.map(|text| original.references.of(text)).collect()
}

fn reference(original: &mut Original, element: &Element, name: &str) -> Option<Reference> {
    let text = element.get(name)?.split_whitespace().next()?;
    Some(original.references.of(text))
}

/// A number in an attribute, which may be infinite or none.
fn loose_number(element: &Element, name: &str, default: f64) -> Result<f64, String> {
    let Some(text) = element.get(name) else { return Ok(default) };
    match text.trim() {
        "Infinity" => Ok(f64::INFINITY),
        "-Infinity" => Ok(f64::NEG_INFINITY),
        text => text
            .parse()
            .map_err(|_| format!("`{name}` of this `{}` is `{}`, which is not a number", element.tag, printable(text))),
    }
}

/// A finite number in an attribute.
fn number(element: &Element, name: &str, default: f64) -> Result<f64, String> {
    let value = loose_number(element, name, default)?;
    if value.is_finite() {
        Ok(value)
    } else {
        Err(format!("`{name}` of this `{}` is {value}; it must be a finite number", element.tag))
    }
}

fn integer(element: &Element, name: &str) -> Result<i64, String> {
    let Some(text) = element.get(name) else { return Ok(0) };
    text.trim().parse().map_err(|_| {
        format!("`{name}` of this `{}` is `{}`, which is not a whole number", element.tag, printable(text))
    })
}

fn count(element: &Element, name: &str) -> Result<u32, String> {
    let value = integer(element, name)?;
    u32::try_from(value).map_err(|_| format!("`{name}` of this `{}` is {value}, which is not a count", element.tag))
}
