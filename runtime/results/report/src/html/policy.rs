//! What the page permits a browser to do: to apply its own style and to run its own script, and nothing else.

use sha2::{Digest as _, Sha256};

/// The Content-Security-Policy of a page with this text: styles and scripts that are written in it, by their hashes.
/// The page loads nothing, even if someone injects markup: no image, no font, nothing from a network.
pub(crate) fn policy(page: &str) -> String {
    let permitted = |kind: &str, element: &str| {
        let hashes = contents(page, element).map(|text| format!(" 'sha256-{}'", base64(&Sha256::digest(text))));
        format!("{kind}{}", hashes.collect::<String>())
    };
    let (style, script) = (permitted("style-src", "style"), permitted("script-src", "script"));
    format!("default-src 'none'; {style}; {script}; base-uri 'none'; form-action 'none'")
}

/// What is in the elements of this name, which have no attributes.
fn contents<'a>(page: &'a str, element: &str) -> impl Iterator<Item = &'a str> {
    let (begin, end) = (format!("<{element}>"), format!("</{element}>"));
    let mut rest = page;
    std::iter::from_fn(move || {
        let (text, after) = rest.split_once(&begin)?.1.split_once(&end)?;
        rest = after;
        Some(text)
    })
}

/// Bytes as base64, filled up with `=`.
fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::new();
    for three in bytes.chunks(3) {
        let bits = three.iter().chain(&[0; 2]).take(3).fold(0, |bits, &byte| bits << 8 | usize::from(byte));
        for digit in 0..4 {
            let shown = if digit <= three.len() { char::from(DIGITS[bits >> (18 - 6 * digit) & 63]) } else { '=' };
            text.push(shown);
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_is_that_of_the_standard() {
        let of = |text: &str| base64(text.as_bytes());
        assert_eq!(
            ["", "f", "fo", "foo", "foob", "fooba", "foobar"].map(of),
            ["", "Zg==", "Zm8=", "Zm9v", "Zm9vYg==", "Zm9vYmE=", "Zm9vYmFy"]
        );
        assert_eq!(base64(&[0xfb, 0xff, 0xfe]), "+//+");
    }
}
