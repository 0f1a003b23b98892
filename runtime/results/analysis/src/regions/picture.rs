//! A tree as a picture: a band for each level, in it a bar for each group of tests, as wide as there are tests, and the
//! redder the more of them fail.

use sesame_plan::CampaignPlan;
use sesame_present::markup::{Markup, percent};

use crate::regions::Regions;
use crate::regions::tree::{Tally, TreeNode};

/// Height of a band, in pixels.
const BAND: f64 = 46.0;

/// How wide a letter is on average, in pixels; more than it is, rather than less.
const LETTER: f64 = 7.4;

/// A width in pixels at which a picture may be shown, and the class of the words that are written for it.
type Screen = (f64, &'static str);

/// On the page, the class decides which words a browser shows.
const ON_PAGE: [Screen; 2] = [(960.0, "words wide"), (330.0, "words narrow")];

/// A file is as wide as it says.
const IN_FILE: [Screen; 1] = [(1000.0, "words")];

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
    let title = format!("Where tests fail: {} ({})", regions.title(), tally(regions.all));
    markup.element("text", &[("class", "words"), ("x", "8"), ("y", "28")], &title);
    markup.open("svg", &[("y", &pixels(BAND))]);
    bars(regions, plan, &mut markup, &IN_FILE);
    markup.close();
    markup.close();
    markup.finish()
}

/// The picture on a page.
pub(super) fn draw(regions: &Regions, plan: &CampaignPlan, markup: &mut Markup) {
    let label = format!("where tests fail: {}, {} regions", regions.title(), regions.rules.len());
    let height = pixels(height(regions));
    markup.open("svg", &[("class", "regions"), ("role", "img"), ("aria-label", &label), ("height", &height)]);
    bars(regions, plan, markup, &ON_PAGE);
    markup.close();
}

fn height(regions: &Regions) -> f64 {
    f64::from(levels(&regions.root)) * BAND
}

fn levels(node: &TreeNode) -> u32 {
    1 + node.split.as_ref().map_or(0, |split| levels(&split.holds).max(levels(&split.fails)))
}

fn bars(regions: &Regions, plan: &CampaignPlan, markup: &mut Markup, screens: &[Screen]) {
    let drawing = Drawing { regions, plan, screens, all: regions.all.tests.max(1) as f64 };
    drawing.bar(markup, &regions.root, "all tests", (0.0, 0.0));
}

/// What all bars of a picture share.
struct Drawing<'a> {
    regions: &'a Regions,
    plan: &'a CampaignPlan,
    screens: &'a [Screen],
    /// Tests of the widest bar.
    all: f64,
}

impl Drawing<'_> {
    fn bar(&self, markup: &mut Markup, node: &TreeNode, words: &str, (before, top): (f64, f64)) {
        let Drawing { regions, plan, screens, all } = *self;
        let width = node.tally.tests as f64 / all;
        let failing = node.tally.failing as f64 / node.tally.tests.max(1) as f64;
        let title = format!("{words}: {}", tally(node.tally));
        let (x, y) = (percent(before / all), pixels(top));
        let (wide, high) = (percent(width), pixels(BAND));
        let place = [("x", x.as_str()), ("y", &y), ("width", &wide), ("height", &high)];
        markup.open("svg", &[&place[..], &[("role", "img"), ("aria-label", &title)]].concat());
        markup.element("title", &[], &title);
        markup.leaf("rect", &[("class", "passing"), ("width", "100%"), ("height", "100%")]);
        let opacity = format!("{failing:.3}");
        markup
            .leaf("rect", &[("class", "violated"), ("width", "100%"), ("height", "100%"), ("fill-opacity", &opacity)]);
        markup.leaf("rect", &[("class", "edge"), ("width", "100%"), ("height", "100%")]);
        for &(screen, class) in screens {
            for (line, y) in fitting(words, node.tally, width * screen).iter().zip(["19", "37"]) {
                markup.element("text", &[("class", class), ("x", "8"), ("y", y)], line);
            }
        }
        markup.close();
        let Some(split) = &node.split else { return };
        let feature = regions.plan_features[split.question.column];
        let mut left = before;
        for (holds, below) in [(true, &split.holds), (false, &split.fails)] {
            let words = feature.words(plan, split.question, holds, split.missing);
            self.bar(markup, below, &words, (left, top + BAND));
            left += below.tally.tests as f64;
        }
    }
}

/// The lines of text that a bar of this width has room for. Its tooltip has all of it.
fn fitting(words: &str, of: Tally, pixels: f64) -> Vec<String> {
    let fits = |text: &str| text.chars().count() as f64 * LETTER + 12.0 <= pixels;
    let short = format!("{} / {}", of.failing, of.tests);
    let counts = [tally(of), short].into_iter().find(|text| fits(text));
    fits(words).then(|| words.to_owned()).into_iter().chain(counts).collect()
}

fn tally(tally: Tally) -> String {
    format!("{} of {} fail", tally.failing, tally.tests)
}

fn pixels(length: f64) -> String {
    format!("{length:.0}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_fit_is_left_out_and_never_cut() {
        let lines = |pixels| fitting("gps_walk lasts over 1.93 s", Tally { tests: 60, failing: 41 }, pixels);
        assert_eq!(lines(400.0), ["gps_walk lasts over 1.93 s", "41 of 60 fail"]);
        assert_eq!(lines(150.0), ["41 of 60 fail"]);
        assert_eq!(lines(70.0), ["41 / 60"]);
        assert!(lines(40.0).is_empty());
    }
}
