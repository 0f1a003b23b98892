//! Operations as pictures: the text as the colours of a PNG, which compresses it. The end is filled up with line feeds.

use std::io::Cursor;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;

/// Why a picture is not text.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    /// It is not base64.
    #[error("the picture is not base64: {0}")]
    Base64(#[from] base64::DecodeError),
    /// It is not a picture of the kind.
    #[error("the picture is not a PNG of this protocol: {0}")]
    Png(#[from] png::DecodingError),
    /// It has other colours.
    #[error("the picture is not one of red, green and blue with eight bits each")]
    Colours,
    /// It would fill the memory.
    #[error("the picture holds more than {0} bytes")]
    Large(usize),
    /// Its colours are not text.
    #[error("the picture holds no text in UTF-8")]
    Text,
}

/// A text as a picture in base64. An empty text is a picture of three line feeds.
pub fn picture(text: &str) -> String {
    let bytes = text.len().max(1);
    let pixels = bytes.div_ceil(3);
    let width = pixels.isqrt();
    let height = pixels.div_ceil(width);
    let mut colours = text.as_bytes().to_vec();
    colours.resize(width * height * 3, b'\n');
    let mut file = Vec::new();
    let side = |length: usize| u32::try_from(length).expect("a text in memory has fewer than 2^64 bytes");
    let mut encoder = png::Encoder::new(&mut file, side(width), side(height));
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let written = encoder.write_header().and_then(|mut writer| writer.write_image_data(&colours));
    written.expect("a picture of this size is written into memory");
    STANDARD.encode(file)
}

/// The text in a picture in base64, without the line feeds that fill it up. A picture with more than `most` bytes is
/// refused before it is decoded.
pub fn text(picture: &str, most: usize) -> Result<String, PictureError> {
    let file = STANDARD.decode(picture.trim())?;
    let decoder = png::Decoder::new_with_limits(Cursor::new(file), png::Limits { bytes: most });
    let mut reader = decoder.read_info()?;
    let info = reader.info();
    if info.color_type != png::ColorType::Rgb || info.bit_depth != png::BitDepth::Eight {
        return Err(PictureError::Colours);
    }
    let size = info.raw_bytes();
    if size > most {
        return Err(PictureError::Large(most));
    }
    let mut colours = vec![0; size];
    let frame = reader.next_frame(&mut colours)?;
    colours.truncate(frame.buffer_size());
    let text = String::from_utf8(colours).map_err(|_| PictureError::Text)?;
    Ok(text.trim_end_matches('\n').to_owned())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn a_text_comes_back_from_its_picture(words in "[a-zä漢🤖{}\":,]{0,300}") {
            prop_assert_eq!(text(&picture(&words), 1 << 20).unwrap(), words);
        }

        #[test]
        fn bytes_that_are_no_picture_are_refused(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
            prop_assert!(text(&STANDARD.encode(bytes), 1 << 20).is_err());
        }
    }

    #[test]
    fn a_picture_that_is_larger_than_permitted_is_refused() {
        let large = picture(&"a".repeat(100_000));
        assert!(large.len() < 2_000, "it compresses");
        assert!(text(&large, 10_000).is_err());
        assert_eq!(text(&large, 200_000).unwrap().len(), 100_000);
    }
}
