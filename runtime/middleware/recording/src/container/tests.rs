//! Files that nobody can trust.

use std::fs;
use std::io::Write as _;

use bzip2::Compression;
use bzip2::write::BzEncoder;
use lz4_flex::frame::FrameEncoder;
use proptest::prelude::*;
use ruzstd::encoding::{CompressionLevel, compress_to_vec};

use super::*;

/// What a file tells, in words, and how it ends.
fn told(bytes: &[u8]) -> (Vec<String>, Result<(), RecordingError>) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("recording");
    fs::write(&file, bytes).unwrap();
    let mut told = Vec::new();
    let read = read(&file, &mut |entry| {
        told.push(match entry {
            Entry::File => return Ok(()),
            Entry::Metadata(name, _) => format!("metadata {name}"),
            Entry::Channel(Channel { id, topic, encoding, schema, .. }) => {
                format!("channel {id} {topic} {encoding} {}", schema.map_or_else(String::new, |schema| schema.name))
            }
            Entry::Message(Message { channel, time, data, .. }) => format!("message {channel} {time} {data:?}"),
        });
        Ok(())
    });
    (told, read)
}

/// Fields behind their lengths.
fn fields(fields: &[(&str, &[u8])]) -> Vec<u8> {
    let mut made = Vec::new();
    for (name, value) in fields {
        made.extend(u32::try_from(name.len() + 1 + value.len()).unwrap().to_le_bytes());
        made.extend(name.bytes());
        made.push(b'=');
        made.extend(*value);
    }
    made
}

fn record(header: &[(&str, &[u8])], data: &[u8]) -> Vec<u8> {
    let header = fields(header);
    let length = |bytes: &[u8]| u32::try_from(bytes.len()).unwrap().to_le_bytes();
    [&length(&header)[..], &header, &length(data), data].concat()
}

fn connection(id: u32) -> Vec<u8> {
    let said = fields(&[("type", b"std_msgs/Float64"), ("message_definition", b"float64 data")]);
    record(&[("op", &[7]), ("conn", &id.to_le_bytes()), ("topic", b"/level")], &said)
}

fn message(connection: u32, seconds: u32, nanos: u32, data: &[u8]) -> Vec<u8> {
    let time = [seconds.to_le_bytes(), nanos.to_le_bytes()].concat();
    record(&[("op", &[2]), ("conn", &connection.to_le_bytes()), ("time", &time)], data)
}

fn chunk(method: &str, size: usize, data: &[u8]) -> Vec<u8> {
    let size = u32::try_from(size).unwrap().to_le_bytes();
    record(&[("op", &[5]), ("compression", method.as_bytes()), ("size", &size)], data)
}

fn bag(records: &[Vec<u8>]) -> Vec<u8> {
    let head = |index: u64| {
        let index = index.to_le_bytes();
        record(&[("op", &[3]), ("index_pos", &index), ("conn_count", &[0; 4]), ("chunk_count", &[0; 4])], b"  ")
    };
    let whole = |index| [b"#ROSBAG V2.0\n".to_vec(), head(index), records.concat()].concat();
    whole(u64::try_from(whole(0).len()).unwrap())
}

fn packed(method: &str, content: &[u8]) -> Vec<u8> {
    match method {
        "bz2" => {
            let mut encoder = BzEncoder::new(Vec::new(), Compression::fast());
            encoder.write_all(content).unwrap();
            encoder.finish().unwrap()
        }
        "lz4" => {
            let mut encoder = FrameEncoder::new(Vec::new());
            encoder.write_all(content).unwrap();
            encoder.finish().unwrap()
        }
        "zstd" => compress_to_vec(content, CompressionLevel::Fastest),
        _ => content.to_vec(),
    }
}

fn made() -> Vec<u8> {
    let inside = [connection(3), message(3, 1, 2, b"ab")].concat();
    let chunks = ["none", "bz2", "lz4"].map(|method| chunk(method, inside.len(), &packed(method, &inside)));
    bag(&[chunks.concat(), message(3, 5, 0, b""), connection(3)])
}

#[test]
fn a_bag_tells_each_connection_once_and_all_its_messages() {
    let (told, read) = told(&made());
    read.unwrap();
    let messages = ["message 3 1000000002 [97, 98]"; 3];
    let expected = [&["channel 3 /level ros1 std_msgs/Float64"], &messages[..], &["message 3 5000000000 []"]].concat();
    assert_eq!(told, expected);
}

#[test]
fn a_bag_that_is_cut_off_is_read_up_to_there() {
    let whole = made();
    let (all, _) = told(&whole);
    for length in HEAD..whole.len() {
        let (told, read) = told(&whole[..length]);
        assert_eq!(told, all[..told.len()]);
        assert!(matches!(read, Err(RecordingError::CutOff { .. })), "{length}: {read:?}");
    }
}

#[test]
fn a_compressed_file_is_read_as_what_it_contains() {
    let whole = made();
    let (told, read) = told(&packed("zstd", &whole));
    read.unwrap();
    assert_eq!(told, super::tests::told(&whole).0);
    let twice = packed("zstd", &packed("zstd", &whole));
    assert!(matches!(super::tests::told(&twice).1, Err(RecordingError::Foreign { .. })));
}

#[test]
fn a_chunk_that_grows_beyond_its_size_is_refused() {
    let much = vec![0; 1 << 22];
    for method in ["bz2", "lz4"] {
        for size in [0, 100, much.len() - 1, much.len() + 1] {
            let (_, read) = told(&bag(&[chunk(method, size, &packed(method, &much))]));
            assert!(matches!(read, Err(RecordingError::Damaged { .. })), "{method} {size}");
        }
        let (_, read) = told(&bag(&[chunk(method, 1 << 30, &packed(method, &much))]));
        assert!(matches!(read, Err(RecordingError::Damaged { .. })), "{method}");
    }
    let (_, read) = told(&bag(&[chunk("lzo", 1, b"?")]));
    assert!(read.unwrap_err().to_string().contains("`lzo`"));
}

#[cfg(feature = "db3")]
#[test]
fn a_database_that_is_no_recording_is_refused_and_one_with_less_than_all_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("bag.db3");
    let database = rusqlite::Connection::open(&file).unwrap();
    database.execute_batch("CREATE TABLE others(id INTEGER)").unwrap();
    assert!(matches!(told(&fs::read(&file).unwrap()).1, Err(RecordingError::Foreign { .. })));
    database
        .execute_batch(
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT);
             CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);
             INSERT INTO topics VALUES (1, '/level', 'std_msgs/msg/Float64', 'cdr');
             INSERT INTO messages VALUES (1, 1, 20, x'01'), (2, 1, 10, x'02'), (3, 1, 30, 'text'), (4, 1, 40, NULL);",
        )
        .unwrap();
    let (told, read) = told(&fs::read(&file).unwrap());
    let expected = ["message 1 10 [2]", "message 1 20 [1]", "message 1 30 [116, 101, 120, 116]"];
    assert_eq!(told[1..], expected);
    assert!(matches!(read, Err(RecordingError::Damaged { .. })), "a message without content");
}

#[cfg(feature = "db3")]
#[test]
fn a_compressed_database_that_grows_without_end_is_refused() {
    // A frame of Zstandard: the beginning of a database as it is, then blocks that are one byte 131,072 times.
    let block = |last: bool, kind: u32, size: u32| (size << 3 | kind << 1 | u32::from(last)).to_le_bytes();
    let mut packed = [&compressed::ZSTD[..], &[0, 0x50]].concat();
    packed.extend(&block(false, 0, 16)[..3]);
    packed.extend(b"SQLite format 3\0");
    for at in 0..1500 {
        packed.extend(&block(at == 1499, 1, 1 << 17)[..3]);
        packed.push(0);
    }
    let (_, read) = told(&packed);
    assert!(read.unwrap_err().to_string().contains("grows to more than 1000 times its size"));
}

proptest! {
    #[test]
    fn no_bytes_are_too_much(start in 0usize..5, bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
        let starts: [&[u8]; 5] = [b"", b"#ROSBAG V2.0\n", b"\x89MCAP0\r\n", b"SQLite format 3\0", &compressed::ZSTD];
        let _ = told(&[starts[start], &bytes].concat());
    }

    #[test]
    fn no_change_of_a_bag_is_too_much(
        changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        packed_whole in any::<bool>(),
    ) {
        let mut bytes = made();
        if packed_whole {
            bytes = packed("zstd", &bytes);
        }
        for (at, byte) in changes {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        let (_, read) = told(&bytes);
        if let Err(error) = read {
            let words = error.to_string();
            prop_assert!(!words.chars().any(char::is_control), "{words:?}");
        }
    }
}
