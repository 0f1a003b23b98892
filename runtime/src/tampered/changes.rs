//! Changes to results. Each is a function of its number.

use std::fs;
use std::path::Path;

use rusqlite::Connection;
use rusqlite::types::Value as Sql;
use serde_json::Value as Json;

use sesame_record::DATABASE;
use sesame_rng::Stream;

use super::whole::Whole;

const NUMBERS: [&str; 22] = [
    "0",
    "-0.0",
    "1",
    "-1",
    "0.5",
    "7",
    "40",
    "255",
    "65536",
    "2147483648",
    "4294967295",
    "4294967296",
    "9007199254740993",
    "9223372036854775807",
    "-9223372036854775808",
    "18446744073709551615",
    "1e-320",
    "1e300",
    "-1.7976931348623157e308",
    "1.7976931348623157e308",
    "1e400",
    "null",
];

const TEXTS: [&str; 8] =
    ["", "\u{1b}[31mred\u{7}", "T1", "reference", "<script>alert(1)</script>", "a\nb", "known_jitter", "日本\u{202e}"];

/// The ends of the tokens of a JSON text, and whether each is one that can be another: a number, a text, a word.
fn tokens(text: &str) -> Vec<(usize, usize)> {
    let bytes = text.as_bytes();
    let (mut found, mut at) = (Vec::new(), 0);
    while at < bytes.len() {
        let start = at;
        match bytes[at] {
            b'"' => {
                at += 1;
                while at < bytes.len() && bytes[at] != b'"' {
                    at += if bytes[at] == b'\\' { 2 } else { 1 };
                }
                at += 1;
            }
            b'{' | b'}' | b'[' | b']' | b':' | b',' | b' ' | b'\n' => {
                at += 1;
                continue;
            }
            _ => {
                while at < bytes.len() && !b"{}[]:, \n".contains(&bytes[at]) {
                    at += 1;
                }
            }
        }
        found.push((start, at.min(bytes.len())));
    }
    found
}

/// All places in a JSON value, by pointers.
fn places(value: &Json, here: &str, found: &mut Vec<String>) {
    found.push(here.to_owned());
    match value {
        Json::Array(items) => {
            items.iter().enumerate().for_each(|(at, item)| places(item, &format!("{here}/{at}"), found));
        }
        Json::Object(members) => {
            for (key, member) in members {
                places(member, &format!("{here}/{}", key.replace('~', "~0").replace('/', "~1")), found);
            }
        }
        _ => {}
    }
}

fn one_of<'a, T: ?Sized>(stream: &mut Stream, of: &'a [&'a T]) -> &'a T {
    of[stream.below(of.len())]
}

/// A plan that is not quite what it was.
fn changed_plan(plan: &str, stream: &mut Stream) -> String {
    let found = tokens(plan);
    if !plan.bytes().any(|byte| byte.is_ascii_digit()) {
        return plan.to_owned();
    }
    let (start, end) = found[stream.below(found.len())];
    match stream.below(5) {
        // A digit.
        0 => {
            let numbers: Vec<usize> = (0..plan.len()).filter(|&at| plan.as_bytes()[at].is_ascii_digit()).collect();
            let at = numbers[stream.below(numbers.len())];
            format!("{}{}{}", &plan[..at], one_of(stream, &["0", "1", "4", "9", "40", "-"]), &plan[at + 1..])
        }
        // A token in the place of another, for a number most often a number.
        1 => {
            let number = plan.as_bytes()[start].is_ascii_digit() || plan.as_bytes()[start] == b'-';
            let (other, another) = found[stream.below(found.len())];
            let put = if number || stream.chance(0.3) {
                one_of(stream, &NUMBERS).to_owned()
            } else if stream.chance(0.5) {
                plan[other..another].to_owned()
            } else {
                serde_json::to_string(one_of(stream, &TEXTS)).unwrap()
            };
            format!("{}{put}{}", &plan[..start], &plan[end..])
        }
        // A number in the place of another, all over the plan.
        2 => {
            let numbers: Vec<_> = found.iter().filter(|(start, _)| plan.as_bytes()[*start].is_ascii_digit()).collect();
            if numbers.is_empty() {
                return plan.to_owned();
            }
            let &&(start, end) = &numbers[stream.below(numbers.len())];
            format!("{}{}{}", &plan[..start], one_of(stream, &NUMBERS), &plan[end..])
        }
        // A branch removed, doubled, or put in the place of another.
        _ => {
            let Ok(mut value) = serde_json::from_str::<Json>(plan) else { return plan.to_owned() };
            let mut found = Vec::new();
            places(&value, "", &mut found);
            let place = found[stream.below(found.len())].clone();
            let other = value.pointer(&found[stream.below(found.len())]).cloned().unwrap();
            let Some((parent, last)) = place.rsplit_once('/') else { return plan.to_owned() };
            let way = stream.below(4);
            match value.pointer_mut(parent).unwrap() {
                Json::Array(items) => {
                    let at: usize = last.parse().unwrap();
                    match way {
                        0 => drop(items.remove(at)),
                        1 => items.insert(at, items[at].clone()),
                        2 => items.swap(0, at),
                        _ => items[at] = other,
                    }
                }
                Json::Object(members) => match way {
                    0 => drop(members.remove(&last.replace("~1", "/").replace("~0", "~"))),
                    1 => drop(members.insert("stray".to_owned(), other)),
                    _ => drop(members.insert(last.replace("~1", "/").replace("~0", "~"), other)),
                },
                _ => {}
            }
            value.to_string()
        }
    }
}

fn hostile_value(stream: &mut Stream, connection: &Connection, table: &str, column: &str) -> Sql {
    let number = *NUMBERS[..21].get(stream.below(21)).unwrap();
    match stream.below(6) {
        0 => Sql::Null,
        1 => Sql::Text((*one_of(stream, &TEXTS)).to_owned()),
        2 => Sql::Real(number.parse().unwrap()),
        3 => number.parse().map_or(Sql::Integer(3), Sql::Integer),
        4 => Sql::Real(f64::INFINITY),
        // What is elsewhere in the column.
        _ => connection
            .query_row(&format!("SELECT {column} FROM {table} ORDER BY random() LIMIT 1"), [], |row| row.get(0))
            .unwrap_or(Sql::Integer(1)),
    }
}

/// Names in a schema, in their order.
fn names(connection: &Connection, sql: &str) -> Vec<String> {
    let mut statement = connection.prepare(sql).unwrap();
    let found = statement.query_map([], |row| row.get(0)).unwrap();
    found.collect::<Result<_, _>>().unwrap()
}

/// Changes values, rows and tables. What SQLite itself refuses is not done.
fn change_in_sql(file: &Path, stream: &mut Stream) {
    let connection = Connection::open(file).unwrap();
    let freely = "PRAGMA foreign_keys = OFF; PRAGMA ignore_check_constraints = ON; PRAGMA synchronous = OFF;";
    connection.execute_batch(freely).unwrap();
    let tables = names(&connection, "SELECT name FROM sqlite_schema WHERE type = 'table' ORDER BY name");
    for _ in 0..=stream.below(3) {
        let table = &tables[stream.below(tables.len())];
        let columns = names(&connection, &format!("SELECT name FROM pragma_table_info('{table}') ORDER BY cid"));
        // It was dropped before.
        if columns.is_empty() {
            continue;
        }
        let column = &columns[stream.below(columns.len())];
        let keys =
            names(&connection, &format!("SELECT name FROM pragma_table_info('{table}') WHERE pk > 0 ORDER BY pk"));
        let keys = keys.join(", ");
        let rows: i64 = connection.query_row(&format!("SELECT count(*) FROM {table}"), [], |row| row.get(0)).unwrap();
        let chosen = stream.below(usize::try_from(rows.max(1)).unwrap());
        let one = format!("({keys}) IN (SELECT {keys} FROM {table} LIMIT 1 OFFSET {chosen})");
        let value = hostile_value(stream, &connection, table, column);
        // SQLite refuses some of it, as it should.
        let _ = match stream.below(12) {
            0 => connection.execute(&format!("DELETE FROM {table} WHERE {one}"), []),
            1 => connection.execute(&format!("UPDATE {table} SET {column} = ?1"), [value]),
            2 => connection.execute(&format!("DELETE FROM {table} WHERE {column} = ?1"), [value]),
            3 if stream.chance(0.2) => {
                let kind = one_of(stream, &["TABLE", "VIEW"]);
                connection.execute_batch(&format!("DROP {kind} {table}")).map(|()| 0)
            }
            _ => connection.execute(&format!("UPDATE {table} SET {column} = ?1 WHERE {one}"), [value]),
        };
    }
}

fn change_in_plan(file: &Path, stream: &mut Stream) {
    let connection = Connection::open(file).unwrap();
    let plan: String = connection.query_row("SELECT plan FROM campaign", [], |row| row.get(0)).unwrap();
    let mut changed = changed_plan(&plan, stream);
    if stream.chance(0.2) && serde_json::from_str::<Json>(&changed).is_ok() {
        changed = changed_plan(&changed, stream);
    }
    connection.pragma_update(None, "synchronous", false).unwrap();
    connection.execute("UPDATE campaign SET plan = ?1", [changed]).unwrap();
}

fn change_bytes(bytes: &mut Vec<u8>, stream: &mut Stream) {
    for _ in 0..=stream.below(3) {
        let from = stream.below(bytes.len());
        let count = if stream.chance(0.7) { stream.below(4) } else { stream.below(400) };
        let to = (from + 1 + count).min(bytes.len());
        let byte = u8::try_from(stream.below(256)).unwrap();
        if stream.chance(0.5) {
            bytes[from..to].fill(byte);
        } else {
            bytes[from..to].iter_mut().for_each(|changed| *changed ^= byte);
        }
    }
    if stream.chance(0.1) {
        bytes.truncate(1 + stream.below(bytes.len()));
    }
}

/// Writes results with the change of this number to this folder. Returns a description of the change for messages.
pub(super) fn tampered(wholes: &[Whole], number: u64, folder: &Path) -> String {
    let mut stream = Stream::derive(11, "tampering", &[number]);
    let whole = &wholes[stream.below(wholes.len())];
    let file = folder.join(DATABASE);
    let log = folder.join(format!("{DATABASE}-wal"));
    for old in [&log, &folder.join(format!("{DATABASE}-shm")), &folder.join(format!("{DATABASE}-journal"))] {
        let _ = fs::remove_file(old);
    }
    fs::write(&file, &whole.database).unwrap();
    if let Some(content) = &whole.log {
        fs::write(&log, content).unwrap();
    }
    let how = match stream.below(10) {
        0..2 => {
            let (file, whole) = match &whole.log {
                Some(log_bytes) if stream.chance(0.5) => (&log, log_bytes),
                _ => (&file, &whole.database),
            };
            let mut bytes = whole.clone();
            change_bytes(&mut bytes, &mut stream);
            fs::write(file, bytes).unwrap();
            "bytes"
        }
        2..6 => {
            change_in_sql(&file, &mut stream);
            "values"
        }
        _ => {
            change_in_plan(&file, &mut stream);
            "plan"
        }
    };
    format!("change {number}: {how} of `{}`", whole.name)
}
