//! Records of a file. Chunks are split here, since the library's reader trusts the lengths inside of a chunk: a damaged
//! one would make it lose its position, or panic.

use mcap::records::{Record, op};
use mcap::{McapError, McapResult, parse_record};

/// The contents of a record: all records of a chunk in order, or the record itself. Kinds that do not occur in traces
/// are left out.
///
/// A chunk that is not complete in length, or has a wrong checksum, is an error; so is a compressed one.
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
