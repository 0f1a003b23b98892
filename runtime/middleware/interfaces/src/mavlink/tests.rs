use super::*;

const SMALL: &str = include_str!("../../tests/small.xml");

/// A dialect that includes another file.
const OWN: &str = r#"<?xml version="1.0"?>
<mavlink>
  <include>small.xml</include>
  <messages>
    <message id="50002" name="OWN"><field type="float" name="level">how much</field></message>
  </messages>
</mavlink>"#;

#[test]
fn fields_are_ordered_by_size_and_extensions_come_last() {
    let definitions = small();
    let everything = definitions.named("EVERYTHING").unwrap();
    let names: Vec<&str> = everything.fields.iter().map(|field| field.name.as_str()).collect();
    let ordered = ["wide", "time", "real", "whole", "row", "small", "name", "letter", "signed", "extra", "more"];
    assert_eq!(names, ordered);
    assert_eq!((everything.base, everything.whole), (43, 52));
    // As pymavlink computes them.
    assert_eq!(definitions.named("HEARTBEAT").unwrap().crc_extra, 50);
    assert_eq!(everything.crc_extra, CRC_EXTRA_OF_EVERYTHING);
}

/// As pymavlink computes it.
const CRC_EXTRA_OF_EVERYTHING: u8 = 192;

fn small() -> Definitions {
    let mut definitions = Definitions::default();
    assert_eq!(definitions.add(SMALL), Ok(Vec::new()));
    definitions
}

/// The definitions in files of a folder in memory.
fn read(named: &[&str], files: &[(&str, &str)]) -> Result<Definitions, Vec<Unusable>> {
    let contents = |path: &Path| {
        let file = files.iter().find(|(name, _)| Path::new("dialects").join(name) == path);
        file.map(|(_, text)| (*text).to_owned()).ok_or("there is no such file".to_owned())
    };
    let named: Vec<String> = named.iter().map(|name| (*name).to_owned()).collect();
    Definitions::read(&named, Path::new("dialects"), &contents)
}

#[test]
fn files_that_are_included_are_read_once_each() {
    // Two that include each other.
    let round = "<mavlink><include>other.xml</include><include> own.xml </include><messages/></mavlink>";
    let other = "<mavlink><include>round.xml</include></mavlink>";
    let files = [("small.xml", SMALL), ("own.xml", OWN), ("round.xml", round), ("other.xml", other)];
    let definitions = read(&["round.xml", "own.xml"], &files).unwrap();
    let names: Vec<&str> = definitions.iter().map(|definition| definition.name.as_str()).collect();
    assert_eq!(names, ["EVERYTHING", "HEARTBEAT", "OWN"]);
}

#[test]
fn what_cannot_be_used_names_the_file() {
    let said = |text: &str| match &read(&["bad.xml"], &[("bad.xml", text)]).unwrap_err()[..] {
        [unusable] => unusable.to_string(),
        several => panic!("{several:?}"),
    };
    let message = |inner: &str| said(&format!("<mavlink><messages>{inner}</messages></mavlink>"));
    assert!(said("<mavlink>").contains("bad.xml` cannot be used: it is not XML"));
    assert!(said("<html/>").contains("does not begin with `<mavlink>`"));
    assert!(said("<mavlink><include>none.xml</include></mavlink>").contains("none.xml"));
    assert!(message(r#"<message id="16777216" name="A"/>"#).contains("no number below 16777216"));
    assert!(message(r#"<message id="1"/>"#).contains("no name"));
    let field = |ty: &str| message(&format!(r#"<message id="1" name="A"><field type="{ty}" name="x"/></message>"#));
    assert!(field("half").contains("message `A`: field `x` has the unknown type `half`"));
    assert!(field("float[0]").contains("`float[0]` is not an array"));
    assert!(field("float[64]").contains("more than 255 bytes"));
    let twice = r#"<message id="1" name="A"><field type="float" name="x"/><field type="float" name="x"/></message>"#;
    assert!(message(twice).contains("two fields `x`"));
    let two = r#"<message id="1" name="A"/><message id="1" name="B"/>"#;
    assert!(message(two).contains("message `B` (1) is defined twice"));
}

#[test]
fn each_file_with_a_mistake_is_named_once() {
    let includes = "<mavlink><include>./none.xml</include><include>worse.xml</include></mavlink>";
    let files = [("small.xml", SMALL), ("includes.xml", includes)];
    let unusable = read(&["missing.xml", "small.xml", "includes.xml"], &files).unwrap_err();
    let said =
        unusable.iter().map(|file| (file.named, file.included, file.path.to_str().unwrap(), file.problem.as_str()));
    let problem = "there is no such file";
    let expected = [(0, false, "dialects/missing.xml", problem), (2, true, "dialects/worse.xml", problem)];
    assert_eq!(said.collect::<Vec<_>>(), expected);
}

#[test]
fn a_chain_of_files_ends() {
    let contents = |path: &Path| {
        let number: u32 = path.file_stem().unwrap().to_str().unwrap().parse().unwrap();
        Ok(format!("<mavlink><include>a/../{}.xml</include></mavlink>", number + 1))
    };
    let unusable = Definitions::read(&["0.xml".to_owned()], Path::new(""), &contents).unwrap_err();
    assert_eq!(unusable[0].problem, "there are more than 100 files");
}

#[test]
fn fields_have_the_types_of_other_interfaces() {
    let fields = small().named("EVERYTHING").unwrap().interface().fields;
    let ty = |name: &str| fields.iter().find(|field| field.name == name).unwrap().ty.clone();
    let of = |primitive| WireType::Primitive { primitive };
    assert_eq!(ty("wide"), of(Primitive::Float64));
    assert_eq!((ty("name"), ty("letter")), (WireType::STRING, WireType::STRING));
    assert_eq!(ty("row"), WireType::Array { of: Box::new(of(Primitive::Int16)), length: 3 });
}

#[test]
fn entries_of_enumerations_are_values_of_fields_by_name() {
    let dialect = |entries: &str| {
        format!(
            "<mavlink><enums><enum name=\"STATE\">{entries}</enum></enums><messages>\
             <message id=\"1\" name=\"STATUS\"><field type=\"uint8_t\" name=\"state\" enum=\"STATE\"/>\
             <field type=\"uint8_t\" name=\"load\"/></message></messages></mavlink>"
        )
    };
    let mut definitions = Definitions::default();
    let first = "<entry value=\"4\" name=\"FOUR\"/><entry name=\"FIVE\"/><entry value=\"0x10\" name=\"SIXTEEN\"/>";
    definitions.add(&dialect(first)).unwrap();
    // Another file may have more entries.
    definitions.add(&dialect("<entry value=\"2**7\" name=\"BIT\"/><entry value=\"4\" name=\"FOUR\"/>")).unwrap();
    let status = definitions.named("STATUS").unwrap();
    let entries = definitions.entries(status);
    let entries: Vec<_> =
        entries.map(|(field, entry)| (field.name.as_str(), entry.name.as_str(), entry.value)).collect();
    let expected = [("FOUR", 4), ("FIVE", 5), ("SIXTEEN", 16), ("BIT", 128)];
    assert_eq!(entries, expected.map(|(name, value)| ("state", name, value)));
    let problem = |entries: &str| definitions.clone().add(&dialect(entries)).unwrap_err();
    assert_eq!(
        problem("<entry value=\"5\" name=\"FOUR\"/>"),
        "entry `FOUR` of the enumeration `STATE` is defined twice, with different numbers"
    );
    assert_eq!(
        problem("<entry value=\"many\" name=\"MORE\"/>"),
        "entry `MORE` of the enumeration `STATE` has no name, or no number"
    );
}

#[test]
fn the_checksum_is_that_of_the_standard() {
    let mut crc = Crc::default();
    crc.add(b"123456789");
    // 0x6F91, folded.
    assert_eq!(crc.folded(), 0x6F ^ 0x91);
}
