//! Records of a file, with chunks taken apart here: the library's reader trusts the lengths inside a chunk, and a damaged
//! one would bring it out of step, or to a panic.

use mcap::records::{Record, op};
use mcap::{McapError, McapResult, parse_record};

/// What a record as it was read holds: all records of a chunk, in order, or itself. Kinds that no trace is made of are
/// left out.
///
/// A chunk is whole, in length and in checksum where it has one, or it is an error. Compressed chunks are one too.
pub(super) fn records(opcode: u8, data: &[u8]) -> McapResult<Vec<Record<'_>>> {
    if opcode != op::CHUNK {
        return Ok(known(opcode, data)?.into_iter().collect());
    }
    let Record::Chunk { header, .. } = parse_record(opcode, data)? else { return Ok(Vec::new()) };
    if !header.compression.is_empty() {
        return Err(McapError::UnsupportedCompression(header.compression));
    }
    // The records are the last part of a chunk.
    let length = usize::try_from(header.compressed_size).map_err(|_| McapError::UnexpectedEoc)?;
    let start = data.len().checked_sub(length).ok_or(McapError::UnexpectedEoc)?;
    let mut rest = &data[start..];
    if header.uncompressed_crc != 0 {
        let calculated = crc32fast::hash(rest);
        if calculated != header.uncompressed_crc {
            return Err(McapError::BadChunkCrc { saved: header.uncompressed_crc, calculated });
        }
    }
    let mut records = Vec::new();
    while !rest.is_empty() {
        let (head, body) = rest.split_at_checked(1 + size_of::<u64>()).ok_or(McapError::UnexpectedEoc)?;
        let length = head[1..].iter().rev().fold(0u64, |length, &byte| length << 8 | u64::from(byte));
        let length = usize::try_from(length).map_err(|_| McapError::UnexpectedEoc)?;
        let (body, after) = body.split_at_checked(length).ok_or(McapError::UnexpectedEoc)?;
        records.extend(known(head[0], body)?);
        rest = after;
    }
    Ok(records)
}

fn known(opcode: u8, data: &[u8]) -> McapResult<Option<Record<'_>>> {
    match opcode {
        op::SCHEMA | op::CHANNEL | op::MESSAGE | op::METADATA => parse_record(opcode, data).map(Some),
        _ => Ok(None),
    }
}
