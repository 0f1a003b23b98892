//! How a test was shrunk, as a section of the page.

use sesame_present::markup::Markup;

use crate::facts::shrinking::Shrinking;
use crate::sentences::{needs_sentences, shrinking_sentence};
use crate::tables;

/// Before and after, the block, and every test that was tried.
pub(super) fn shrinking(body: &mut Markup, shrinking: &Shrinking, drawn: &[u32]) {
    body.open("section", &[("class", "shrinking")]);
    body.heading(&format!("{} shrunk", shrinking.test));
    body.element("p", &[], &format!("{}.", shrinking_sentence(shrinking)));
    for sentence in needs_sentences(shrinking) {
        body.element("p", &[], &format!("{sentence}."));
    }
    tables::sizes(shrinking).html(body, drawn);
    let caption = "Active: how long operations were active in total. Intensity P1: the mean of the parameters as shares of \
                   what is permitted. Strength: the sum over operations of how far their parameters are from their \
                   mildest values, each from 0 to 1.";
    body.element("p", &[("class", "quiet")], caption);
    let thresholds = tables::thresholds(shrinking);
    if !thresholds.is_empty() {
        body.element("p", &[], "Where parameters begin to matter: one step milder, the test does not fail.");
        thresholds.html(body, &[]);
    }
    if let Some(block) = &shrinking.block {
        body.element("pre", &[], block);
    }
    body.open("details", &[]);
    body.element("summary", &[], "Every test that was tried");
    tables::all_steps(shrinking).html(body, &[]);
    body.close();
    body.close();
}
