//! XML, element by element, so that a file of any size is read in little memory.

use std::fmt;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Seek as _, SeekFrom};
use std::path::{Path, PathBuf};

use quick_xml::XmlVersion;
use quick_xml::events::{BytesStart, Event};
use quick_xml::reader::Reader;
use sesame_base::visible::{is_hidden, visible};

/// Levels of elements at most: conditions nest, but nobody nests them this deep.
const DEEPEST: usize = 200;

/// Bytes of one element at most: of one that is read with all that is in it, else of its first tag alone.
const LARGEST: u64 = 32 << 20;

/// An element; of names only the part without their namespace, which differs between files that mean the same.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Element {
    /// Its name.
    pub(crate) tag: String,
    /// Its `xsi:type`.
    pub(crate) kind: Option<String>,
    /// Its other attributes.
    pub(crate) attributes: Vec<(String, String)>,
    /// The text directly in it.
    pub(crate) text: String,
    /// The elements directly in it; empty until [`Source::whole`] has read them.
    pub(crate) children: Vec<Element>,
}

impl Element {
    /// An attribute.
    pub(crate) fn get(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(key, _)| key == name).map(|(_, value)| value.as_str())
    }
}

/// Why a file could not be imported: one diagnostic, with its place.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Broken {
    /// The file.
    pub file: PathBuf,
    /// Line and column, from 1, where there is a place.
    pub place: Option<(usize, usize)>,
    /// What is wrong, and what to do about it.
    pub what: String,
}

impl fmt::Display for Broken {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.file.display())?;
        if let Some((line, column)) = self.place {
            write!(f, ":{line}:{column}")?;
        }
        write!(f, ": {}", self.what)
    }
}

impl std::error::Error for Broken {}

/// What comes next in a file.
pub(crate) enum Step {
    /// An element begins; its children follow up to its [`Step::Close`].
    Open(Element),
    /// The element that is open ends.
    Close,
    /// The file ends.
    End,
}

/// A file of which only so many bytes are read before somebody says otherwise.
struct Bounded {
    file: BufReader<File>,
    left: u64,
}

impl BufRead for Bounded {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        let available = self.file.fill_buf()?;
        if self.left == 0 && !available.is_empty() {
            return Err(io::ErrorKind::FileTooLarge.into());
        }
        let most = usize::try_from(self.left).unwrap_or(usize::MAX);
        Ok(&available[..available.len().min(most)])
    }

    fn consume(&mut self, used: usize) {
        self.left -= used as u64;
        self.file.consume(used);
    }
}

impl Read for Bounded {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let available = self.fill_buf()?;
        let count = available.len().min(into.len());
        into[..count].copy_from_slice(&available[..count]);
        self.consume(count);
        Ok(count)
    }
}

/// A file that is being read.
pub(crate) struct Source {
    path: PathBuf,
    reader: Reader<Bounded>,
    buffer: Vec<u8>,
    /// Names of the elements that are open.
    open: Vec<String>,
    /// An element without content was opened, and is to be closed.
    closing: bool,
    /// Where the last step began, in bytes.
    at: u64,
}

impl Source {
    pub(crate) fn new(path: &Path, file: File) -> Source {
        Source {
            path: path.to_owned(),
            reader: Reader::from_reader(Bounded { file: BufReader::new(file), left: LARGEST }),
            buffer: Vec::new(),
            open: Vec::new(),
            closing: false,
            at: 0,
        }
    }

    /// The next step; texts between elements are passed over.
    pub(crate) fn next(&mut self) -> Result<Step, Broken> {
        self.reader.get_mut().left = LARGEST;
        self.step().map(|(step, _)| step)
    }

    /// The rest of an element that was just opened: it with all that is in it. What is then found to be
    /// [broken](Self::broken) is where it began.
    pub(crate) fn whole(&mut self, opened: Element) -> Result<Element, Broken> {
        let began = self.at;
        let mut stack = vec![opened];
        loop {
            let (step, text) = self.step()?;
            let top = stack.last_mut().expect("the loop ends with the last element");
            top.text.push_str(text.trim());
            match step {
                Step::Open(element) => stack.push(element),
                Step::Close => {
                    let closed = stack.pop().expect("the loop ends with the last element");
                    let Some(parent) = stack.last_mut() else {
                        self.at = began;
                        return Ok(closed);
                    };
                    parent.children.push(closed);
                }
                Step::End => unreachable!("a file does not end in an element"),
            }
        }
    }

    /// The next step, and the text before it.
    fn step(&mut self) -> Result<(Step, String), Broken> {
        let mut text = String::new();
        if self.closing {
            self.closing = false;
            self.open.pop();
            return Ok((Step::Close, text));
        }
        loop {
            self.buffer.clear();
            self.at = self.reader.buffer_position();
            let event = match self.reader.read_event_into(&mut self.buffer) {
                Ok(event) => event,
                Err(_) if self.reader.get_ref().left == 0 => {
                    let what = format!(
                        "what begins here has more than {} MiB, which is not part of a testing space; leave it out of the file",
                        LARGEST >> 20
                    );
                    return Err(self.broken(what));
                }
                Err(error) => {
                    let (at, what) = (self.reader.error_position(), error.to_string());
                    return Err(self.not_xml(at, &what));
                }
            };
            let (begun, empty) = match event {
                Event::Start(ref begun) => (begun, false),
                Event::Empty(ref begun) => (begun, true),
                Event::End(_) => {
                    self.open.pop();
                    return Ok((Step::Close, text));
                }
                Event::Eof => {
                    return match self.open.last() {
                        None => Ok((Step::End, text)),
                        Some(open) => {
                            let what = format!("the file ends inside of `{open}`; it was cut off");
                            Err(self.not_xml(self.at, &what))
                        }
                    };
                }
                Event::Text(ref words) => {
                    text.push_str(&words.xml10_content());
                    continue;
                }
                Event::CData(ref words) => {
                    text.push_str(&words.xml10_content());
                    continue;
                }
                Event::GeneralRef(ref reference) => {
                    let named = match &*reference.xml10_content() {
                        "lt" => Some('<'),
                        "gt" => Some('>'),
                        "amp" => Some('&'),
                        "quot" => Some('"'),
                        "apos" => Some('\''),
                        _ => reference.resolve_char_ref().ok().flatten(),
                    };
                    match named {
                        Some(character) => text.push(character),
                        None => return Err(self.not_xml(self.at, "an entity that XML does not have")),
                    }
                    continue;
                }
                Event::DocType(_) => return Err(self.not_xml(self.at, "a DOCTYPE, which no such file has")),
                Event::Decl(_) | Event::PI(_) | Event::Comment(_) => continue,
            };
            let element = match element(begun) {
                Ok(element) => element,
                Err(what) => return Err(self.not_xml(self.at, &what)),
            };
            if self.open.len() >= DEEPEST {
                return Err(self.not_xml(self.at, &format!("elements are nested more than {DEEPEST} levels deep")));
            }
            self.open.push(element.tag.clone());
            self.closing = empty;
            return Ok((Step::Open(element), text));
        }
    }

    /// Something in the file that is wrong, in the element that was read last.
    pub(crate) fn broken(&self, what: impl Into<String>) -> Broken {
        Broken {
            file: self.path.clone(),
            place: self.rewound().and_then(|file| place_of(file, self.at)),
            what: what.into(),
        }
    }

    /// Something that is not XML; often for a reason that people know better.
    fn not_xml(&self, at: u64, what: &str) -> Broken {
        if let Some(line) = self.rewound().and_then(merge_marker) {
            return Broken {
                file: self.path.clone(),
                place: Some((line, 1)),
                what: "two versions of the file were merged, and the conflict here was never resolved; keep one side, \
                       delete the lines that begin with `<<<<<<<`, `=======` and `>>>>>>>`, and import it again"
                    .to_owned(),
            };
        }
        Broken {
            file: self.path.clone(),
            place: self.rewound().and_then(|file| place_of(file, at)),
            what: format!("this is not XML: {what}"),
        }
    }

    /// The file from its first byte, to find a place in it. Nothing more can be read as XML afterwards.
    fn rewound(&self) -> Option<BufReader<&File>> {
        let mut file = self.reader.get_ref().file.get_ref();
        file.seek(SeekFrom::Start(0)).ok()?;
        Some(BufReader::new(file))
    }
}

/// An element as its first tag has it.
fn element(begun: &BytesStart<'_>) -> Result<Element, String> {
    let tag = begun.local_name().into_inner().to_owned();
    if !is_name(&tag) {
        return Err(format!("`{}` is not a name of an element", printable(&tag)));
    }
    let mut element = Element { tag, ..Element::default() };
    for attribute in begun.attributes() {
        let attribute = attribute.map_err(|error| error.to_string())?;
        let value = attribute.normalized_value(XmlVersion::Implicit1_0).map_err(|error| error.to_string())?;
        let key = attribute.key.into_inner();
        match key.split_once(':') {
            Some(("xmlns", _)) => {}
            _ if key == "xmlns" => {}
            Some(("xsi", "type")) => element.kind = Some(local(&value).to_owned()),
            Some((_, local)) => element.attributes.push((local.to_owned(), value.into_owned())),
            None => element.attributes.push((key.to_owned(), value.into_owned())),
        }
    }
    Ok(element)
}

/// A name without its namespace, `TestingMM.Metrics:StreamMetric` as `StreamMetric`.
fn local(name: &str) -> &str {
    name.rsplit([':', '.']).next().unwrap_or(name)
}

fn is_name(name: &str) -> bool {
    name.starts_with(|first: char| first.is_alphabetic() || first == '_')
        && name.chars().all(|c| c.is_alphanumeric() || matches!(c, '_' | '-' | '.'))
}

/// What can be shown on a terminal of a text that anybody may have written.
pub(crate) fn printable(text: &str) -> String {
    let shown: String = visible(text).chars().take(80).collect();
    shown.trim().to_owned()
}

/// A text without what no line holds, and of a length that a file can.
pub(crate) fn cleaned(text: &str) -> String {
    let cleaned: String = text.chars().filter(|&c| !is_hidden(c)).take(1000).collect();
    cleaned.trim().to_owned()
}

/// The first line of a file that is a marker of a merge conflict. The file is read line by line, and no further than
/// 64 bytes into each.
fn merge_marker(mut reader: BufReader<&File>) -> Option<usize> {
    let mut line = Vec::new();
    for number in 1.. {
        line.clear();
        if reader.by_ref().take(64).read_until(b'\n', &mut line).ok()? == 0 {
            return None;
        }
        if line.starts_with(b"<<<<<<< ") || line.starts_with(b">>>>>>> ") {
            return Some(number);
        }
        if line.last() != Some(&b'\n') {
            skip_line(&mut reader)?;
        }
    }
    None
}

fn skip_line(reader: &mut impl BufRead) -> Option<()> {
    loop {
        let (used, ended) = {
            let available = reader.fill_buf().ok()?;
            match available.iter().position(|&byte| byte == b'\n') {
                Some(at) => (at + 1, true),
                None => (available.len(), available.is_empty()),
            }
        };
        reader.consume(used);
        if ended {
            return Some(());
        }
    }
}

/// Line and column of a byte of a file, both from 1.
fn place_of(reader: BufReader<&File>, offset: u64) -> Option<(usize, usize)> {
    let mut reader = reader.take(offset);
    let (mut line, mut column) = (1, 1);
    loop {
        let used = {
            let available = reader.fill_buf().ok()?;
            if available.is_empty() {
                return Some((line, column));
            }
            for &byte in available {
                if byte == b'\n' {
                    (line, column) = (line + 1, 1);
                } else {
                    column += 1;
                }
            }
            available.len()
        };
        reader.consume(used);
    }
}
