//! Certificates that are too hard for the check: the check reports what it did not decide, and claims no more.

use std::fmt::Write as _;

use sesame_dsl::source::SourceMap;
use sesame_dsl::{Analysis, analyse};

/// A guarantee that needs a hole of its own for each of so many pigeons, with one hole less than there are pigeons.
/// A search has to look at the ways in which they may sit.
fn pigeons(count: usize) -> String {
    let (mut topics, mut evidence, mut needs) = (String::new(), String::new(), Vec::new());
    for pigeon in 0..count {
        let holes: Vec<String> = (1..count).map(|hole| format!("in{pigeon}_{hole}")).collect();
        needs.push(format!("({})", holes.join(" or ")));
        for hole in 1..count {
            let _ = writeln!(topics, "topic t{pigeon}_{hole} = \"{pigeon}/{hole}\" : bool");
            let _ = writeln!(evidence, "evidence in{pigeon}_{hole} = t{pigeon}_{hole}");
            let _ = writeln!(evidence, "evidence out{pigeon}_{hole} = not t{pigeon}_{hole}");
            needs.extend((0..pigeon).map(|other| format!("(out{pigeon}_{hole} or out{other}_{hole})")));
        }
    }
    format!(
        "space pigeons\nsystem {{\nsimulator sim = in_process \"sim::Sim\" {{ crate \"sim\"  step 20ms }}\n\
         topic state = \"state\" : bool\n{topics}}}\n\
         eddi holes publishes state {{\n{evidence}guarantee all integrity 1 = {}\notherwise none\n}}\n",
        needs.join(" and ")
    )
}

fn analysed(text: &str) -> Analysis {
    let mut sources = SourceMap::new();
    let root = sources.add("pigeons.sesame", text);
    analyse(&sources, root)
}

#[test]
fn what_is_not_decided_is_said_once_for_all_parts_of_a_monitor() {
    let easy = analysed(&pigeons(4));
    assert!(easy.undecided.is_empty(), "{:?}", easy.undecided);
    assert!(easy.has_errors(), "it can never hold");
    let hard = analysed(&pigeons(8));
    assert!(!hard.has_errors(), "nothing is claimed of it");
    let said: Vec<&str> = hard.undecided.iter().map(|(_, text)| text.as_str()).collect();
    let [can_hold, decides] = said[..] else { panic!("{said:#?}") };
    assert_eq!(can_hold, "whether `all` of monitor `holes` can hold was not decided: the search reached its limit");
    assert!(decides.starts_with("whether `in0_1`, `out0_1`, `in0_2` and "), "{decides}");
    assert!(
        decides.ends_with(" others of monitor `holes` decide anything was not decided: the search reached its limit")
    );
    let larger = analysed(&pigeons(12));
    let [(_, said)] = &larger.undecided[..] else { panic!("{:#?}", larger.undecided) };
    assert_eq!(said, "the guarantees of `holes` are not checked: they and what they need are too many");
}
