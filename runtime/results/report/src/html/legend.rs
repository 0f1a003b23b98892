//! What the names of the reduced parameter space mean, where the page uses them.

use sesame_plan::Dimension;
use sesame_present::markup::Markup;

/// Explains these dimensions, folded away.
pub(super) fn legend(body: &mut Markup, dimensions: &[Dimension]) {
    let names: Vec<&str> = dimensions.iter().map(|dimension| dimension.name()).collect();
    let names = match names.as_slice() {
        [first, .., last] if names.len() > 3 => format!("{first} to {last}"),
        _ => names.join(", "),
    };
    body.open("details", &[("class", "legend")]);
    body.element("summary", &[], &format!("What {names} {}", if dimensions.len() == 1 { "means" } else { "mean" }));
    body.open("dl", &[]);
    for &dimension in dimensions {
        body.open("div", &[]);
        body.element("dt", &[], dimension.name());
        body.element("dd", &[], meaning(dimension));
        body.close();
    }
    body.close();
    body.element(
        "p",
        &[("class", "quiet")],
        "They reduce a test to a point: when it disturbs, how strongly, and with what. T followed by a number of a test, \
         as in the tables, is another name: T0 is the reference run, T1 the first test.",
    );
    body.close();
}

/// A dimension in words for someone who does not know the method.
fn meaning(dimension: Dimension) -> &'static str {
    match dimension {
        Dimension::T1 => {
            "When: the mean of the midpoints of the times in which operations were active; 0 is the beginning of what is \
             permitted, 1 its end."
        }
        Dimension::T2 => "How long: the mean length of these times, as a share of what is permitted.",
        Dimension::T3 => "How scattered in time: the standard deviation of the midpoints.",
        Dimension::P1 => "How strong: the mean of the parameters; 0 is the low end of their ranges, 1 the high end.",
        Dimension::P2 => "How uneven: the standard deviation of the parameters.",
        Dimension::O0 => "How many operations the test has.",
        Dimension::O1 => "How many of them change values.",
        Dimension::O2 => "How many of them lose messages.",
        Dimension::O3 => "How many of them delay messages.",
    }
}
