//! A tree as a picture: a band for each level, in it a bar for each group of tests, as wide as there are tests, and the
//! redder the more of them fail.

use sesame_plan::CampaignPlan;

use crate::analysis::regions::Regions;
use crate::analysis::regions::tree::{Node, Tally};
use crate::report::{Markup, percent};

/// Height of a band, in pixels.
const BAND: f64 = 46.0;

/// Colours of a file that stands alone; on the page the page's own count.
const STYLE: &str = "svg{font:13px system-ui,sans-serif}.passing{fill:#b9c6d3}.violated{fill:#c2410c}.edge{fill:none;stroke:#fff;\
                     stroke-width:2}.words{fill:#1b2330}";

/// The picture as a file of its own.
pub(super) fn file(regions: &Regions, plan: &CampaignPlan) -> String {
    let mut markup = Markup::default();
    let height = pixels(height(regions) + 2.0 * BAND);
    let attributes = [("xmlns", "http://www.w3.org/2000/svg"), ("width", "1000"), ("height", height.as_str())];
    markup.open("svg", &attributes);
    markup.element("style", &[], STYLE);
    let title = format!("Where tests fail: {} ({})", regions.target, tally(regions.all));
    markup.element("text", &[("class", "words"), ("x", "8"), ("y", "28")], &title);
    markup.open("svg", &[("y", &pixels(BAND))]);
    bars(regions, plan, &mut markup);
    markup.close();
    markup.close();
    markup.finish()
}

/// The picture on a page.
pub(super) fn draw(regions: &Regions, plan: &CampaignPlan, markup: &mut Markup) {
    let label = format!("where tests fail: {}, {} regions", regions.target, regions.rules.len());
    let height = pixels(height(regions));
    markup.open("svg", &[("class", "regions"), ("role", "img"), ("aria-label", &label), ("height", &height)]);
    bars(regions, plan, markup);
    markup.close();
}

fn height(regions: &Regions) -> f64 {
    f64::from(levels(&regions.root)) * BAND
}

fn levels(node: &Node) -> u32 {
    1 + node.split.as_ref().map_or(0, |split| levels(&split.holds).max(levels(&split.fails)))
}

fn bars(regions: &Regions, plan: &CampaignPlan, markup: &mut Markup) {
    let all = regions.all.tests.max(1) as f64;
    bar(regions, plan, markup, &regions.root, "all tests", (0.0, 0.0), all);
}

fn bar(
    regions: &Regions,
    plan: &CampaignPlan,
    markup: &mut Markup,
    node: &Node,
    words: &str,
    (before, top): (f64, f64),
    all: f64,
) {
    let width = node.tally.tests as f64 / all;
    let failing = node.tally.failing as f64 / node.tally.tests.max(1) as f64;
    let title = format!("{words}: {}", tally(node.tally));
    let (x, y) = (percent(before / all), pixels(top));
    let (wide, high) = (percent(width), pixels(BAND));
    // What does not fit into a bar is cut off there, as pictures inside others are; pointing at it tells it whole.
    let place = [("x", x.as_str()), ("y", &y), ("width", &wide), ("height", &high)];
    markup.open("svg", &[&place[..], &[("role", "img"), ("aria-label", &title)]].concat());
    markup.element("title", &[], &title);
    markup.leaf("rect", &[("class", "passing"), ("width", "100%"), ("height", "100%")]);
    let opacity = format!("{failing:.3}");
    markup.leaf("rect", &[("class", "violated"), ("width", "100%"), ("height", "100%"), ("fill-opacity", &opacity)]);
    markup.leaf("rect", &[("class", "edge"), ("width", "100%"), ("height", "100%")]);
    markup.element("text", &[("class", "words"), ("x", "8"), ("y", "19")], words);
    markup.element("text", &[("class", "words"), ("x", "8"), ("y", "37")], &tally(node.tally));
    markup.close();
    let Some(split) = &node.split else { return };
    let feature = regions.plan_features[split.question.column];
    let mut left = before;
    for (holds, below) in [(true, &split.holds), (false, &split.fails)] {
        let words = feature.words(plan, split.question, holds, split.missing);
        bar(regions, plan, markup, below, &words, (left, top + BAND), all);
        left += below.tally.tests as f64;
    }
}

fn tally(tally: Tally) -> String {
    format!("{} of {} fail", tally.failing, tally.tests)
}

fn pixels(length: f64) -> String {
    format!("{length:.0}")
}
