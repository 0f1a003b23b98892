//! The type of which all payloads of a topic are, as the language has types.
//!
//! A message with a field less than declared, or with one of another kind, is not of its declared type. So fields that
//! came as values of several kinds are left out, and the reason is given. Fields that came in some messages only are
//! optional, or left out too where messages have all of their fields.

use sesame_notation::is_name;

use crate::facts::LeftOut;
use crate::samples::{Samples, Seen};

/// A type.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Guess {
    /// True or false.
    Bool,
    /// A whole number. That only whole numbers came does not say that there will be no others.
    Int,
    /// A number.
    Real,
    /// Text.
    Text,
    /// A point.
    Point,
    /// A time of ROS.
    Time,
    /// Values of one type.
    List(Box<Guess>),
    /// Named values.
    Message {
        /// The fields, by name.
        fields: Vec<GuessedField>,
        /// The others.
        left_out: Vec<LeftOut>,
    },
}

/// A field of a guessed message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GuessedField {
    /// Its name.
    pub name: String,
    /// Its type.
    pub guess: Guess,
    /// Whether some messages lacked it, or had `null` in its place.
    pub optional: bool,
}

/// How a middleware writes in JSON what JSON does not have, and what the relay reads there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Conventions {
    /// Payloads in JSON without a protocol around them.
    Json,
    /// The conventions of a bridge to ROS.
    Rosbridge,
    /// The conventions of SimlogAPI, version 2.
    Simlog2,
    /// The conventions of SimlogAPI, version 3.
    Simlog3,
}

impl Conventions {
    /// Whether an object of the numbers `x`, `y` and `z` is a point.
    fn points(self) -> bool {
        self != Conventions::Json
    }

    /// Whether an object of `sec` and `nanosec`, or of `secs` and `nsecs`, is a time.
    fn times(self) -> bool {
        self == Conventions::Rosbridge
    }

    /// Whether `null` in the place of a number is NaN.
    fn null_is_nan(self) -> bool {
        self == Conventions::Rosbridge
    }

    /// Whether messages may lack fields, or have `null` in their places.
    fn optional_fields(self) -> bool {
        self == Conventions::Json
    }

    /// Whether a payload may be any text, so that one of several kinds is a text.
    fn any_text(self) -> bool {
        self == Conventions::Simlog2
    }
}

impl Samples {
    /// The type of all payloads; or why there is none, in a clause.
    pub fn guess(&self, conventions: Conventions) -> Result<Guess, String> {
        let root = &self.root;
        let guess = root.guess(conventions);
        // What is text on the wire may be read as text, whatever it looks like.
        let of_texts = root.nulls + root.lists + root.objects + root.deep == 0;
        match guess {
            Err(_) if conventions.any_text() && of_texts && root.values() > 0 => Ok(Guess::Text),
            guess => guess,
        }
    }
}

impl Seen {
    fn guess(&self, conventions: Conventions) -> Result<Guess, String> {
        let all = self.values();
        if all == 0 {
            return Err("nothing came".to_owned());
        }
        let numbers = self.numbers() + if conventions.null_is_nan() { self.nulls } else { 0 };
        if self.bools == all {
            Ok(Guess::Bool)
        } else if self.wholes == all {
            Ok(Guess::Int)
        } else if numbers == all && self.wholes + self.reals > 0 {
            Ok(Guess::Real)
        } else if self.texts + self.words == all {
            Ok(Guess::Text)
        } else if self.lists == all {
            match &self.items {
                Some(items) => Ok(Guess::List(Box::new(items.guess(conventions).map_err(|why| in_list(&why))?))),
                None => Err("its lists were empty".to_owned()),
            }
        } else if self.objects == all {
            self.object(conventions)
        } else {
            Err(format!("it came as {}", self.in_words()))
        }
    }

    fn object(&self, conventions: Conventions) -> Result<Guess, String> {
        let has = |names: &[&str]| {
            let exactly = !self.more && self.fields.keys().map(String::as_str).eq(names.iter().copied());
            exactly && self.fields.values().all(|field| field.values() == self.objects)
        };
        let nulls = |field: &Seen| if conventions.null_is_nan() { field.nulls } else { 0 };
        let numbers = || self.fields.values().all(|field| field.numbers() + nulls(field) == field.values());
        if conventions.points() && has(&["x", "y", "z"]) && numbers() {
            return Ok(Guess::Point);
        }
        let is_time = has(&["nanosec", "sec"]) || has(&["nsecs", "secs"]);
        if conventions.times() && is_time && self.fields.values().all(|field| field.wholes == field.values()) {
            return Ok(Guess::Time);
        }
        let (mut fields, mut left_out) = (Vec::new(), Vec::new());
        for (name, field) in &self.fields {
            // The language wants a letter or a digit in it.
            let optional = conventions.optional_fields() && (field.values() < self.objects || field.nulls > 0);
            let guess = if !is_name(name) || !name.contains(|c: char| c.is_ascii_alphanumeric()) {
                Err("its name cannot be that of a field in a space".to_owned())
            } else if optional {
                Seen { nulls: 0, ..field.clone() }.guess(conventions)
            } else if field.values() < self.objects {
                Err(format!("only {} of {} objects have it", field.values(), self.objects))
            } else {
                field.guess(conventions)
            };
            match guess {
                Ok(guess) => fields.push(GuessedField { name: name.clone(), guess, optional }),
                Err(why) => left_out.push(LeftOut { name: name.clone(), why }),
            }
        }
        if self.more {
            left_out
                .push(LeftOut { name: "…".to_owned(), why: "there are more fields than a scan keeps".to_owned() });
        }
        if fields.is_empty() {
            let why = left_out.first().map(|first| format!(", for example not `{}`: {}", first.name, first.why));
            return Err(format!("its objects have no field that a space can declare{}", why.unwrap_or_default()));
        }
        Ok(Guess::Message { fields, left_out })
    }

    fn in_words(&self) -> String {
        let kinds = [
            (self.nulls, "null"),
            (self.bools, "a truth value"),
            (self.numbers(), "a number"),
            (self.texts, "a text"),
            (self.lists, "a list"),
            (self.objects, "an object"),
            (self.deep, "what is nested too deeply"),
        ];
        let kinds: Vec<&str> = kinds.into_iter().filter(|(count, _)| *count > 0).map(|(_, word)| word).collect();
        match kinds.split_last() {
            Some((last, [])) => (*last).to_owned(),
            Some((last, others)) => format!("{} and {last}", others.join(", ")),
            None => "nothing".to_owned(),
        }
    }
}

fn in_list(why: &str) -> String {
    format!("of its elements: {why}")
}

#[cfg(test)]
mod tests;
