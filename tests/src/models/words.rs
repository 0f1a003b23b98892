//! Names and texts.

use std::collections::BTreeSet;
use std::sync::LazyLock;

use super::draw::Draw;

/// What stands in hostile texts and nowhere else: where it turns up as anything but text, a text became something.
pub const MARK: &str = "injected";

/// Names that mean something to Rust, to generated code, to SQLite, to cargo, or to the language at other places.
static NAMES: LazyLock<Vec<&str>> = LazyLock::new(|| {
    "fn type match self Self crate super async await gen dyn impl mod use struct static yield try macro_rules \
     union abstract box const loop pub move ref let enum extern unsafe where while typeof become u8 f64 i64 str \
     usize main Context Option Vec String Default Box Some None Ok Err Result Hook Text Drop Value Record Fields \
     Debug Clone Copy From Into Iterator RunContext OperationContext FromValue ToValue Mismatch Simulator Runner \
     std core alloc generated hooks target src messages metrics registry operations_ campaign_ runner \
     sesame_runtime anything_sim test_ build tests results number name origin outcome front rowid select Table \
     order group index ctx message_ parameters value values now topic_ step random offset absolute packet loss \
     latency uniform drain finish flush drop blackhole time population evaluations per times after mcap failing \
     all every outbound max sum each fuzzing_time custom before start file one set pause parameter condition over \
     depth integers for at most initial contains integer con nul aux _ __ _1 a A x1y2 T0 R1 SELF Zone ZONE zone \
     zOnE zone_ _zone zone__1 zone1 zone_1 Zone1 ZoNe_1 new default_ level Level LEVEL leVel"
        .split(' ')
        .collect()
});

/// Names that other kinds may have, but not these.
const NOT_A_MESSAGE: &[&str] = &["bool", "int", "real", "text", "point", "list"];

/// What texts are made of.
const HOSTILE: &[&str] = &[
    "\"",
    "'",
    "\\",
    "`",
    "{{",
    "}}",
    "{%",
    "%}",
    "{#",
    "{",
    "}",
    "{0}",
    "{:?}",
    "/*",
    "*/",
    "//",
    "///",
    "//!",
    "#",
    "#!",
    "#[",
    "]",
    "<",
    ">",
    "&",
    "&lt;",
    "<!--",
    "-->",
    "]]>",
    "$",
    "$(",
    "`",
    ";",
    "--",
    "../",
    "..",
    "/",
    "%00",
    "\\n",
    "\\u{0}",
    "\r\u{b}",
    "\t",
    "\u{0}",
    "\u{1b}[31m",
    "\u{7f}",
    "\u{85}",
    "\u{a0}",
    "\u{202e}",
    "\u{2066}",
    "\u{200b}",
    "\u{2028}",
    "\u{feff}",
    "é",
    "e\u{301}",
    "ß",
    "İ",
    "漢字",
    "🤖",
    "\u{10ffff}",
    " ",
    "  ",
    "r#\"",
    "\"#",
    "\u{fffd}",
];

/// Hostile texts that do something if they are taken for code.
const INJECTIONS: [&str; 9] = [
    "\"); injected(); (\"",
    "*/ fn injected() {} /*",
    "{{ injected }}",
    "{% include \"injected\" %}",
    "<script>injected()</script>",
    "<b injected=\"1\" onload='injected()'>",
    "'; DROP TABLE tests; -- injected",
    "\"]\n[injected]",
    "../../../injected",
];

/// Gives out names: each once, and among those of one kind none that differs from another in case or underscores only.
#[derive(Default)]
pub(super) struct Names {
    taken: BTreeSet<String>,
    generated: BTreeSet<(&'static str, String)>,
}

/// How long a name may be for it to be a file's.
const LONGEST: usize = 60;

fn candidate(draw: &mut Draw) -> String {
    let word = (*draw.one(&NAMES)).to_owned();
    match draw.below(8) {
        0 => word.to_uppercase(),
        1 => format!("{word}_{}", draw.below(100)),
        2 => {
            let mut long = word;
            while long.len() < LONGEST {
                long = long + "_" + *draw.one(&NAMES);
            }
            long.truncate(LONGEST);
            long
        }
        _ => word,
    }
}

impl Names {
    /// A name for something of a kind. Kinds that share files or types are one.
    pub(super) fn take(&mut self, draw: &mut Draw, kind: &'static str) -> String {
        loop {
            let name = candidate(draw);
            let generated = name.replace('_', "").to_ascii_lowercase();
            let refused = name.starts_with('_')
                || kind == "message" && NOT_A_MESSAGE.contains(&name.as_str())
                || name.contains("__") && kind == "space"
                || self.taken.contains(&name)
                || self.generated.contains(&(kind, generated.clone()));
            if !refused {
                self.taken.insert(name.clone());
                self.generated.insert((kind, generated));
                return name;
            }
        }
    }
}

/// Different names of fields or parameters; they belong to what holds them, and may differ in case only.
pub(super) fn own_names(draw: &mut Draw, n: usize) -> Vec<String> {
    // What ends the choices of an operation in a test cannot be the name of one.
    const ENDS: [&str; 3] = ["seed", "before", "after"];
    let mut names: Vec<String> = Vec::new();
    while names.len() < n {
        let name = candidate(draw);
        if !name.starts_with('_') && !names.contains(&name) && !ENDS.contains(&name.as_str()) {
            names.push(name);
        }
    }
    names
}

/// A hostile text on one line, without line ends; never empty, not only spaces.
pub(super) fn text(draw: &mut Draw) -> String {
    let mut text = String::new();
    for _ in 0..draw.between(1, 6) {
        match draw.below(5) {
            0 => text += *draw.one::<&str>(&INJECTIONS),
            1 => text += *draw.one(&NAMES),
            _ => text += *draw.one::<&str>(HOSTILE),
        }
    }
    if draw.chance(0.02) {
        text = text.repeat(200);
    }
    let text = text.replace(['\n', '\r'], " ");
    if text.trim().is_empty() { MARK.to_owned() } else { text }
}

/// A text as the language writes it.
pub(super) fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""))
}

/// The doc comments of an item: none, or some lines.
pub(super) fn docs(draw: &mut Draw) -> String {
    let lines = if draw.chance(0.4) { draw.between(1, 3) } else { 0 };
    // What begins with a slash would make it a plain comment.
    (0..lines).map(|_| format!("/// {}\n", text(draw))).collect::<Vec<_>>().concat()
}

/// A path on the wire: no spaces, no control characters, braces only of a group.
pub(super) fn path(draw: &mut Draw, number: usize) -> String {
    let hostile: String = text(draw)
        .chars()
        .filter(|&c| !c.is_whitespace() && !c.is_control() && c != '{' && c != '}')
        .take(80)
        .collect();
    // The number keeps paths apart.
    match draw.below(4) {
        0 => format!("{number}{{a,b{hostile}b}}/x"),
        1 => format!("{number}{hostile}{{1,2,3}}"),
        _ => format!("{hostile}{number}"),
    }
}

/// A path of a file below the folder of the space.
pub(super) fn file(draw: &mut Draw, number: usize) -> String {
    let hostile: String = text(draw).chars().filter(|&c| !c.is_control() && !"/\\:".contains(c)).take(20).collect();
    format!("config {number}/{}{number}.yaml", hostile.trim())
}
