use sha2::{Digest, Sha256};

#[test]
fn each_module_was_generated_from_the_file_that_is_there() {
    let of = [
        ("simlog2", &include_bytes!("../../proto/simlog2.proto")[..], include_str!("v2.rs")),
        ("simlog3", &include_bytes!("../../proto/simlog3.proto")[..], include_str!("v3.rs")),
        ("simserver3", &include_bytes!("../../proto/simserver3.proto")[..], include_str!("simulator3.rs")),
    ];
    for (name, file, module) in of {
        let digest = hexadecimal(&Sha256::digest(file));
        let mend = "call `cargo run` in runtime/middleware/simlog/generate";
        assert!(module.contains(&digest), "proto/{name}.proto has changed: {mend}");
    }
}

fn hexadecimal(bytes: &[u8]) -> String {
    let digit = |nibble: u8| char::from_digit(u32::from(nibble), 16).expect("a nibble is a digit");
    bytes.iter().flat_map(|byte| [digit(byte >> 4), digit(byte & 15)]).collect()
}
