//! `.idl` files as the tools of ROS generate and accept them, and enumerations, which other tools of DDS write: modules
//! with structs, enumerations, constants and typedefs.

use std::collections::BTreeMap;

use sesame_plan::{Primitive, WireType};

use crate::{Constant, Definition, DefinitionError, Field, LONGEST_ARRAY, definition, is_name};

/// The interfaces that an `.idl` file declares. Their names are those of its modules, so of the file
/// `std_msgs/msg/Header.idl` it is `std_msgs/msg/Header`.
pub fn idl(text: &str) -> Result<Vec<Definition>, DefinitionError> {
    let mut parser = Parser {
        tokens: tokens(text)?,
        at: 0,
        modules: Vec::new(),
        typedefs: BTreeMap::new(),
        lengths: BTreeMap::new(),
    };
    let (mut found, mut constants) = (Vec::new(), BTreeMap::new());
    parser.members(&mut found, &mut constants)?;
    for definition in &mut found {
        // The constants of a message are in a module of its own.
        if let Some(own) = constants.remove(&format!("{}_Constants", definition.name)) {
            definition.constants = own;
        }
    }
    Ok(found)
}

#[derive(Debug, Clone, PartialEq, Eq)]
enum Token {
    Word(String),
    /// A number, or a quoted text with its quotes.
    Literal(String),
    Sign(char),
}

struct Parser {
    tokens: Vec<(usize, Token)>,
    at: usize,
    modules: Vec<String>,
    /// What other names of types stand for.
    typedefs: BTreeMap<String, WireType>,
    /// The constants that can be lengths.
    lengths: BTreeMap<String, u32>,
}

type Constants = BTreeMap<String, Vec<Constant>>;

/// How many values an array can hold.
const LENGTHS: std::ops::RangeInclusive<u32> = 1..=LONGEST_ARRAY;

/// The deepest nesting of modules and sequences.
const DEEPEST: usize = 20;

impl Parser {
    fn line(&self) -> usize {
        let last = self.tokens.len().checked_sub(1);
        last.map_or(1, |last| self.tokens[self.at.min(last)].0)
    }

    fn wrong<T>(&self, problem: impl Into<String>) -> Result<T, DefinitionError> {
        Err(DefinitionError { line: self.line(), problem: problem.into() })
    }

    fn peek(&self) -> Option<&Token> {
        self.tokens.get(self.at).map(|(_, token)| token)
    }

    fn next(&mut self) -> Option<Token> {
        let token = self.peek().cloned();
        self.at += 1;
        token
    }

    /// A name in the module at hand.
    fn full_name(&self, name: &str) -> String {
        self.modules.iter().map(String::as_str).chain([name]).collect::<Vec<_>>().join("/")
    }

    /// What a name stands for: the nearest declaration, from the module at hand outwards.
    fn nearest<T: Clone>(&self, declared: &BTreeMap<String, T>, name: &str) -> Option<T> {
        let name = name.replace("::", "/");
        if let Some(absolute) = name.strip_prefix('/') {
            return declared.get(absolute).cloned();
        }
        (0..=self.modules.len()).rev().find_map(|depth| {
            let full = self.modules[..depth].iter().map(String::as_str).chain([name.as_str()]);
            declared.get(&full.collect::<Vec<_>>().join("/")).cloned()
        })
    }

    fn sign(&mut self, sign: char) -> Result<(), DefinitionError> {
        if self.peek() == Some(&Token::Sign(sign)) {
            self.at += 1;
            return Ok(());
        }
        self.wrong(format!("expected `{sign}`"))
    }

    fn takes(&mut self, sign: char) -> bool {
        let found = self.peek() == Some(&Token::Sign(sign));
        self.at += usize::from(found);
        found
    }

    fn word(&mut self) -> Result<String, DefinitionError> {
        match self.peek() {
            Some(Token::Word(word)) => {
                let word = word.clone();
                self.at += 1;
                Ok(word)
            }
            _ => self.wrong("expected a name"),
        }
    }

    /// A name that declares something.
    fn name(&mut self) -> Result<String, DefinitionError> {
        let name = self.word()?;
        if is_name(&name) { Ok(name) } else { self.wrong(format!("`{name}` is not a name")) }
    }

    fn members(&mut self, found: &mut Vec<Definition>, constants: &mut Constants) -> Result<(), DefinitionError> {
        // What `@bit_bound` says about the next declaration.
        let mut bound = None;
        while let Some(token) = self.peek() {
            let bits = bound.take();
            match token {
                Token::Sign('}') if !self.modules.is_empty() => return Ok(()),
                Token::Sign('@') => bound = self.annotation()?.or(bits),
                Token::Word(word) => match word.as_str() {
                    "module" => self.module(found, constants)?,
                    "struct" => found.push(self.structure()?),
                    "enum" => self.enumeration(bits)?,
                    "const" => {
                        let constant = self.constant()?;
                        if let Some(length) = constant.value.parse().ok().filter(|length| LENGTHS.contains(length)) {
                            self.lengths.insert(self.full_name(&constant.name), length);
                        }
                        constants.entry(self.modules.join("/")).or_default().push(constant);
                    }
                    "typedef" => self.typedef()?,
                    other => {
                        let other = other.to_owned();
                        return self.wrong(format!("`{other}` is not supported here"));
                    }
                },
                _ => return self.wrong("expected `module`, `struct`, `enum`, `const` or `typedef`"),
            }
        }
        if self.modules.is_empty() { Ok(()) } else { self.wrong("the file ends inside of a module") }
    }

    fn module(&mut self, found: &mut Vec<Definition>, constants: &mut Constants) -> Result<(), DefinitionError> {
        self.at += 1;
        let name = self.name()?;
        if self.modules.len() >= DEEPEST {
            return self.wrong("modules nest too deeply");
        }
        self.modules.push(name);
        self.sign('{')?;
        self.members(found, constants)?;
        self.sign('}')?;
        self.takes(';');
        self.modules.pop();
        Ok(())
    }

    fn structure(&mut self) -> Result<Definition, DefinitionError> {
        self.at += 1;
        let name = self.name()?;
        self.sign('{')?;
        let mut fields: Vec<Field> = Vec::new();
        while !self.takes('}') {
            if self.peek() == Some(&Token::Sign('@')) {
                self.annotation()?;
                continue;
            }
            for (name, ty) in self.declared()? {
                if fields.iter().any(|other| other.name == name) {
                    return self.wrong(format!("field `{name}` is there twice"));
                }
                fields.push(Field { name, ty });
            }
        }
        self.takes(';');
        // What the tools of ROS write for an interface without fields.
        fields.retain(|field| field.name != "structure_needs_at_least_one_member");
        Ok(definition(self.full_name(&name), fields, Vec::new()))
    }

    fn constant(&mut self) -> Result<Constant, DefinitionError> {
        self.at += 1;
        self.ty(0)?;
        let name = self.name()?;
        self.sign('=')?;
        let mut value = String::new();
        loop {
            match self.next() {
                Some(Token::Sign(';')) => return Ok(Constant { name, value }),
                Some(Token::Word(text) | Token::Literal(text)) => value.push_str(&text),
                Some(Token::Sign(sign)) => value.push(sign),
                None => return self.wrong("the file ends inside of a constant"),
            }
        }
    }

    fn typedef(&mut self) -> Result<(), DefinitionError> {
        self.at += 1;
        for (name, ty) in self.declared()? {
            self.typedefs.insert(self.full_name(&name), ty);
        }
        Ok(())
    }

    /// One type, and the names that have it or are arrays of it.
    fn declared(&mut self) -> Result<Vec<(String, WireType)>, DefinitionError> {
        let ty = self.ty(0)?;
        let mut declared = Vec::new();
        loop {
            let name = self.name()?;
            declared.push((name, self.dimensions(ty.clone())?));
            if !self.takes(',') {
                self.sign(';')?;
                return Ok(declared);
            }
        }
    }

    /// An enumeration. On the wire it is a number of as many bits as it needs, 32 unless `@bit_bound` says less.
    fn enumeration(&mut self, bits: Option<u32>) -> Result<(), DefinitionError> {
        self.at += 1;
        let primitive = match bits {
            None | Some(17..=32) => Primitive::Int32,
            Some(9..=16) => Primitive::Int16,
            Some(1..=8) => Primitive::Int8,
            Some(bits) => return self.wrong(format!("an enumeration has 1 to 32 bits, not {bits}")),
        };
        let name = self.name()?;
        self.sign('{')?;
        loop {
            while self.peek() == Some(&Token::Sign('@')) {
                self.annotation()?;
            }
            self.name()?;
            if !self.takes(',') {
                break;
            }
        }
        self.sign('}')?;
        self.takes(';');
        self.typedefs.insert(self.full_name(&name), WireType::Primitive { primitive });
        Ok(())
    }

    /// `@name` with its arguments in parentheses. Only `@bit_bound` means anything on the wire: its number is returned.
    fn annotation(&mut self) -> Result<Option<u32>, DefinitionError> {
        self.at += 1;
        let mut bits = None;
        let bounds_bits = self.word()? == "bit_bound";
        if self.takes('(') {
            let mut open = 1;
            while open > 0 {
                match self.next() {
                    Some(Token::Sign('(')) => open += 1,
                    Some(Token::Sign(')')) => open -= 1,
                    Some(Token::Literal(text)) if bounds_bits => bits = text.parse().ok(),
                    Some(_) => {}
                    None => return self.wrong("the file ends inside of an annotation"),
                }
            }
        }
        Ok(bits)
    }

    /// `[N]` behind a name.
    fn dimensions(&mut self, mut ty: WireType) -> Result<WireType, DefinitionError> {
        let mut lengths = Vec::new();
        while self.takes('[') {
            lengths.push(self.length()?);
            self.sign(']')?;
        }
        for length in lengths.into_iter().rev() {
            ty = WireType::Array { of: Box::new(ty), length };
        }
        Ok(ty)
    }

    fn length(&mut self) -> Result<u32, DefinitionError> {
        let length = match self.next() {
            Some(Token::Literal(text)) => text.parse().ok(),
            Some(Token::Word(name)) => self.nearest(&self.lengths, &name),
            _ => None,
        };
        match length.filter(|length| LENGTHS.contains(length)) {
            Some(length) => Ok(length),
            None => self.wrong(format!("expected a length from 1 to {LONGEST_ARRAY}, or a constant with one")),
        }
    }

    fn ty(&mut self, depth: usize) -> Result<WireType, DefinitionError> {
        if depth > DEEPEST {
            return self.wrong("sequences nest too deeply");
        }
        let word = self.word()?;
        let primitive = |primitive| Ok(WireType::Primitive { primitive });
        match word.as_str() {
            "boolean" => primitive(Primitive::Bool),
            "octet" | "char" | "uint8" => primitive(Primitive::Uint8),
            "int8" => primitive(Primitive::Int8),
            "int16" | "short" => primitive(Primitive::Int16),
            // ROS sends half of a wide character.
            "uint16" | "wchar" => primitive(Primitive::Uint16),
            "int32" => primitive(Primitive::Int32),
            "uint32" => primitive(Primitive::Uint32),
            "int64" => primitive(Primitive::Int64),
            "uint64" => primitive(Primitive::Uint64),
            "float" => primitive(Primitive::Float32),
            "double" => primitive(Primitive::Float64),
            "long" => match self.peek() {
                Some(Token::Word(next)) if next == "long" => {
                    self.at += 1;
                    primitive(Primitive::Int64)
                }
                Some(Token::Word(next)) if next == "double" => self.wrong("`long double` is not supported"),
                _ => primitive(Primitive::Int32),
            },
            "unsigned" => match self.word()?.as_str() {
                "short" => primitive(Primitive::Uint16),
                "long" => {
                    if matches!(self.peek(), Some(Token::Word(next)) if next == "long") {
                        self.at += 1;
                        return primitive(Primitive::Uint64);
                    }
                    primitive(Primitive::Uint32)
                }
                _ => self.wrong("expected `short` or `long`"),
            },
            "string" | "wstring" => {
                let bound = if self.takes('<') {
                    let bound = self.length()?;
                    self.sign('>')?;
                    Some(bound)
                } else {
                    None
                };
                Ok(if word == "string" { WireType::String { bound } } else { WireType::WString { bound } })
            }
            "sequence" => {
                self.sign('<')?;
                let of = Box::new(self.ty(depth + 1)?);
                let bound = if self.takes(',') { Some(self.length()?) } else { None };
                self.sign('>')?;
                Ok(WireType::Sequence { of, bound })
            }
            name => {
                let full = if name.contains("::") {
                    name.trim_start_matches("::").replace("::", "/")
                } else {
                    self.full_name(name)
                };
                if let Some(ty) = self.nearest(&self.typedefs, name) {
                    return Ok(ty);
                }
                if !full.split('/').all(is_name) {
                    return self.wrong(format!("`{name}` is not a type"));
                }
                Ok(WireType::Interface { name: full })
            }
        }
    }
}

/// Words, literals and signs; comments and lines for the preprocessor are left out.
fn tokens(text: &str) -> Result<Vec<(usize, Token)>, DefinitionError> {
    let mut tokens = Vec::new();
    let mut line = 1;
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let length = match first {
            '\n' => {
                line += 1;
                1
            }
            _ if first.is_whitespace() => first.len_utf8(),
            '#' => rest.find('\n').unwrap_or(rest.len()),
            '/' if rest.starts_with("//") => rest.find('\n').unwrap_or(rest.len()),
            '/' if rest.starts_with("/*") => {
                let Some(end) = rest.find("*/") else {
                    return Err(DefinitionError { line, problem: "a comment has no end".to_owned() });
                };
                line += rest[..end].matches('\n').count();
                end + 2
            }
            '"' | '\'' => {
                let mut escaped = false;
                let end = rest[1..].find(|c: char| {
                    let is_end = c == first && !escaped;
                    escaped = c == '\\' && !escaped;
                    is_end
                });
                let Some(end) = end else {
                    return Err(DefinitionError { line, problem: "a text has no end".to_owned() });
                };
                let literal = &rest[..end + 2];
                tokens.push((line, Token::Literal(literal.to_owned())));
                line += literal.matches('\n').count();
                end + 2
            }
            _ if first.is_ascii_alphabetic() || first == '_' || rest.starts_with("::") => {
                let mut end = 0;
                loop {
                    let tail = &rest[end..];
                    if tail.starts_with("::") {
                        end += 2;
                    } else if tail.starts_with(|c: char| c.is_ascii_alphanumeric() || c == '_') {
                        end += 1;
                    } else {
                        break;
                    }
                }
                tokens.push((line, Token::Word(rest[..end].to_owned())));
                end
            }
            _ if first.is_ascii_digit() => {
                let end = rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '.').unwrap_or(rest.len());
                tokens.push((line, Token::Literal(rest[..end].to_owned())));
                end
            }
            _ => {
                tokens.push((line, Token::Sign(first)));
                first.len_utf8()
            }
        };
        rest = &rest[length..];
    }
    Ok(tokens)
}
