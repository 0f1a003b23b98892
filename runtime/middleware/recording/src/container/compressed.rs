//! What is compressed in recordings, decompressed in bounded memory.

use std::io::{self, BufRead, Read};

use bzip2::bufread::MultiBzDecoder;
use lz4_flex::frame::FrameDecoder;
use ruzstd::decoding::StreamingDecoder;

/// How a frame of Zstandard begins.
pub(super) const ZSTD: [u8; 4] = [0x28, 0xb5, 0x2f, 0xfd];

/// As much memory is asked for at once, whatever size a file claims.
const AT_ONCE: usize = 1 << 20;

/// A method by which chunks are compressed.
type Method = for<'a> fn(&'a [u8]) -> io::Result<Box<dyn Read + 'a>>;

/// The methods by the names that MCAP and bags of ROS 1 have for them.
const METHODS: [(&str, Method); 5] = [
    ("", |data| Ok(Box::new(data))),
    ("none", |data| Ok(Box::new(data))),
    ("lz4", |data| Ok(Box::new(FrameDecoder::new(data)))),
    ("zstd", |data| Ok(Box::new(Frames { rest: Some(data), now: None }))),
    ("bz2", |data| Ok(Box::new(MultiBzDecoder::new(data)))),
];

/// Why something cannot be decompressed.
pub(crate) enum Wrong {
    /// Nobody knows the method.
    Method,
    /// It is not what the method makes, or not of the size that is claimed.
    Content(String),
}

/// The content of a chunk that is said to have so many bytes.
pub(crate) fn chunk(method: &str, data: &[u8], size: usize) -> Result<Vec<u8>, Wrong> {
    let known = METHODS.iter().find(|(name, _)| *name == method);
    let (_, open) = known.ok_or(Wrong::Method)?;
    let wrong = |error: &io::Error| Wrong::Content(format!("a chunk cannot be decompressed: {error}"));
    let mut content = Vec::with_capacity(size.min(AT_ONCE));
    let mut reader = open(data).map_err(|error| wrong(&error))?;
    let limit = (size as u64).saturating_add(1);
    reader.by_ref().take(limit).read_to_end(&mut content).map_err(|error| wrong(&error))?;
    if content.len() == size {
        Ok(content)
    } else {
        Err(Wrong::Content("a chunk has another size than it says".to_owned()))
    }
}

/// The content of a message that is compressed by itself, of at most so many bytes.
#[cfg(feature = "db3")]
pub(crate) fn message(data: &[u8], most: usize) -> io::Result<Vec<u8>> {
    let mut content = Vec::new();
    let frames = Frames { rest: Some(data), now: None };
    frames.take((most as u64).saturating_add(1)).read_to_end(&mut content)?;
    if content.len() > most { Err(io::Error::other("it is too large")) } else { Ok(content) }
}

/// The content of a compressed file.
pub(super) fn file(file: impl BufRead) -> impl Read {
    Frames { rest: Some(file), now: None }
}

/// The frames of Zstandard in a file, one after another.
struct Frames<R: BufRead> {
    /// What follows the frames that were read; `None` while one is.
    rest: Option<R>,
    now: Option<Box<StreamingDecoder<R, ruzstd::decoding::FrameDecoder>>>,
}

impl<R: BufRead> Read for Frames<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        loop {
            if let Some(decoder) = &mut self.now {
                let read = decoder.read(buffer).map_err(|error| invalid(&error))?;
                if read > 0 || buffer.is_empty() {
                    return Ok(read);
                }
                self.rest = self.now.take().map(|decoder| decoder.into_inner());
            }
            let Some(mut rest) = self.rest.take() else { return Ok(0) };
            if rest.fill_buf()?.is_empty() {
                self.rest = Some(rest);
                return Ok(0);
            }
            let decoder = StreamingDecoder::new(rest).map_err(|error| invalid(&error))?;
            self.now = Some(Box::new(decoder));
        }
    }
}

fn invalid(error: &impl std::fmt::Display) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, format!("it cannot be decompressed: {error}"))
}
