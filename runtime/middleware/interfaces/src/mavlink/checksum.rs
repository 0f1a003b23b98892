//! The checksum of frames, which also tells definitions apart.

/// The checksum of `MAVLink`, CRC-16/MCRF4XX.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Crc(u16);

impl Default for Crc {
    fn default() -> Self {
        Crc(u16::MAX)
    }
}

/// For each byte the remainder of its division by the polynomial, lowest bit first.
const REMAINDERS: [u16; 256] = {
    let mut remainders = [0; 256];
    let mut byte: u16 = 0;
    while byte < 256 {
        let (mut remainder, mut bit) = (byte, 0);
        while bit < 8 {
            remainder = if remainder & 1 == 1 { (remainder >> 1) ^ 0x8408 } else { remainder >> 1 };
            bit += 1;
        }
        remainders[byte as usize] = remainder;
        byte += 1;
    }
    remainders
};

impl Crc {
    /// Adds these bytes.
    pub fn add(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            let [low, high] = self.0.to_le_bytes();
            self.0 = REMAINDERS[usize::from(low ^ byte)] ^ u16::from(high);
        }
    }

    /// Its two bytes, combined into one.
    pub fn folded(self) -> u8 {
        let [low, high] = self.0.to_le_bytes();
        low ^ high
    }

    /// The checksum of a frame: of its bytes without the first one, and of the extra byte of its definition.
    pub fn of_frame(bytes: &[u8], extra: u8) -> [u8; 2] {
        let mut crc = Crc::default();
        crc.add(bytes);
        crc.add(&[extra]);
        crc.0.to_le_bytes()
    }
}
