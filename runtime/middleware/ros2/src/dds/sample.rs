//! Samples as bytes: whatever they hold, they are neither read nor changed.

use std::cell::Cell;
use std::convert::Infallible;
use std::sync::Arc;

use rustdds::bytes::Bytes;
use rustdds::{RepresentationIdentifier as Encoding, no_key};

/// A sample with the header that says how it is encoded, as ROS hands it out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Sample(pub(crate) Arc<[u8]>);

/// The header: the encoding, and options that XCDR 1 does not use.
const HEADER: usize = 4;

impl Sample {
    pub(super) fn encoding(&self) -> Encoding {
        match *self.0 {
            [first, second, ..] => Encoding::from_bytes(&[first, second]).unwrap_or(Encoding::CDR_LE),
            _ => Encoding::CDR_LE,
        }
    }
}

/// Passes samples between DDS and us without reading them.
pub(super) struct Adapter;

/// Puts the header in front of the bytes.
#[derive(Clone)]
pub(super) struct Decoder;

impl no_key::DeserializerAdapter<Sample> for Adapter {
    type Error = Infallible;
    type Decoded = Sample;

    fn supported_encodings() -> &'static [Encoding] {
        const ALL: [Encoding; 16] = [
            Encoding::CDR_LE,
            Encoding::CDR_BE,
            Encoding::PL_CDR_LE,
            Encoding::PL_CDR_BE,
            Encoding::CDR2_LE,
            Encoding::CDR2_BE,
            Encoding::PL_CDR2_LE,
            Encoding::PL_CDR2_BE,
            Encoding::D_CDR_LE,
            Encoding::D_CDR_BE,
            Encoding::XCDR2_LE,
            Encoding::XCDR2_BE,
            Encoding::D_CDR2_LE,
            Encoding::D_CDR2_BE,
            Encoding::PL_XCDR2_LE,
            Encoding::PL_XCDR2_BE,
        ];
        &ALL
    }

    fn transform_decoded(decoded: Sample) -> Sample {
        decoded
    }
}

impl no_key::Decode<'_, Sample> for Decoder {
    type Error = Infallible;

    fn decode_bytes(self, bytes: &[u8], encoding: Encoding) -> Result<Sample, Infallible> {
        let mut sample = Vec::with_capacity(HEADER + bytes.len());
        sample.extend_from_slice(&encoding.to_bytes());
        sample.extend_from_slice(&[0, 0]);
        sample.extend_from_slice(bytes);
        Ok(Sample(sample.into()))
    }
}

impl no_key::DefaultDecoder<Sample> for Adapter {
    type Decoder = Decoder;
    const DECODER: Decoder = Decoder;
}

thread_local! {
    /// The encoding of the sample that is being written. The interface of DDS wants one encoding per type; here it is a
    /// property of each sample, which keeps the encoding it came in.
    static ENCODING: Cell<Encoding> = const { Cell::new(Encoding::CDR_LE) };
}

/// Writes a sample of this encoding.
pub(super) fn with_encoding<T>(encoding: Encoding, write: impl FnOnce() -> T) -> T {
    ENCODING.set(encoding);
    write()
}

impl no_key::SerializerAdapter<Sample> for Adapter {
    type Error = Infallible;

    fn output_encoding() -> Encoding {
        ENCODING.get()
    }

    fn to_bytes(sample: &Sample) -> Result<Bytes, Infallible> {
        Ok(Bytes::copy_from_slice(sample.0.get(HEADER..).unwrap_or_default()))
    }
}
