//! A new user: `sesamec new`, and then what it prints, only that.

use std::fs;

use sesame_tests::{command, done, fresh_folder, sesamec};

/// The indented lines of what `new` printed: commands to give, and one line of Rust.
fn instructions(said: &str) -> Vec<&str> {
    said.lines().filter_map(|line| line.strip_prefix("         ")).collect()
}

#[test]
fn following_what_new_prints_leads_to_a_front() {
    let folder = fresh_folder("new");
    let said = done(command(sesamec()).args(["new", "demo"]).current_dir(&folder)).expect(0).err;
    let [generate, body, run] = instructions(&said)[..] else { panic!("three steps are printed: {said}") };

    // The first command, as typed into a shell that knows sesamec.
    let call = |line: &str| {
        let mut words = line.split_whitespace();
        assert_eq!(words.next(), Some("sesamec"), "{line}");
        done(command(sesamec()).args(words).current_dir(&folder)).expect(0)
    };
    call(generate);

    // The edit, in the file and the function it names.
    let words = |after: &str| {
        let rest = said.split(after).nth(1).unwrap_or_else(|| panic!("no `{after}` in: {said}"));
        rest.split([',', '`']).next().unwrap().trim().to_owned()
    };
    let hook = folder.join(words("fill in the stub: in "));
    let function = words("replace the body of `");
    let stub = fs::read_to_string(&hook).unwrap();
    let (before, rest) = stub.split_once(&format!("fn {function}(")).expect("the stub has the function");
    let (signature, rest) = rest.split_once("{\n").unwrap();
    let (_, after) = rest.split_once("\n    }\n").unwrap();
    fs::write(&hook, format!("{before}fn {function}({signature}{{\n        {body}\n    }}\n{after}")).unwrap();

    let ran = call(run);
    assert!(ran.out.contains("front of"), "{}", ran.out);
    assert!(ran.out.contains("R1"), "the cart comes too close to the wall in some test: {}", ran.out);
    assert!(!ran.err.contains("warning"), "a filled-in stub compiles without a warning: {}", ran.err);
}
