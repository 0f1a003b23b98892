//! Randomness: one seed, split by purpose.
//!
//! Every stream is derived from the campaign's seed and the path of its purpose, never from another stream's state. So
//! an additional operation or worker does not shift the random numbers of others, and no state needs to be saved to
//! resume.
//!
//! The functions are inlined, since searches and relays draw in their innermost loops, and most purposes are
//! constants.

use rand_core::Rng as _;
use rand_pcg::Pcg64;

/// A stream of random numbers with value-stable derivations.
#[derive(Debug, Clone)]
pub struct Stream(Pcg64);

impl Stream {
    /// The stream of a purpose under a seed, for example `(seed, "mutation", &[generation, child])`.
    pub fn derive(seed: u64, purpose: &str, path: &[u64]) -> Self {
        let low = derive_seed(seed, purpose, path);
        let high = mix(low ^ 0x6A09_E667_F3BC_C909);
        let state = (u128::from(high) << 64) | u128::from(low);
        Stream(Pcg64::new(state, u128::from(mix(high))))
    }

    /// 64 random bits.
    #[inline]
    pub fn bits(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// Uniform in `[0, 1)`, with 53 random bits.
    #[inline]
    pub fn unit(&mut self) -> f64 {
        unit_from_bits(self.bits())
    }

    /// Uniform in `[low, high)`, or `low` when the range is empty.
    #[inline]
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Uniform over `0..n`; `n` must be positive.
    #[inline]
    pub fn below(&mut self, n: usize) -> usize {
        assert!(n > 0, "a choice needs something to choose from");
        // The high half of a 64 × 64 bit product; the bias is below 2^-53 for every n that fits in memory.
        #[expect(clippy::cast_possible_truncation, reason = "the product's high half is below n")]
        let index = ((u128::from(self.bits()) * n as u128) >> 64) as usize;
        index
    }

    /// True with this probability.
    #[inline]
    pub fn chance(&mut self, probability: f64) -> bool {
        self.unit() < probability
    }

    /// A standard normal number (Box–Muller, one of the pair).
    #[inline]
    pub fn normal(&mut self) -> f64 {
        let radius = libm::sqrt(-2.0 * libm::log(1.0 - self.unit()));
        radius * libm::cos(std::f64::consts::TAU * self.unit())
    }

    /// A uniformly shuffled copy of the order `0..n`.
    pub fn permutation(&mut self, n: usize) -> Vec<usize> {
        let mut order: Vec<usize> = (0..n).collect();
        for last in (1..n).rev() {
            order.swap(last, self.below(last + 1));
        }
        order
    }
}

/// The seed of a purpose under a seed.
#[inline]
pub fn derive_seed(seed: u64, purpose: &str, path: &[u64]) -> u64 {
    // FNV-1a over the purpose separates the names; `mix` after each step spreads every bit.
    let name = purpose
        .bytes()
        .fold(0xCBF2_9CE4_8422_2325, |hash: u64, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01B3));
    path.iter().fold(mix(seed ^ mix(name)), |state, &part| mix(state ^ mix(part.wrapping_add(0x9E37_79B9_7F4A_7C15))))
}

/// A random number in `[0, 1)` keyed by a seed and two indices (message, field): the same key always gives the same
/// number.
#[inline]
pub fn keyed_unit(seed: u64, message: u64, field: u64) -> f64 {
    unit_from_bits(mix(mix(seed ^ mix(message)) ^ field.wrapping_mul(0x9E37_79B9_7F4A_7C15)))
}

fn unit_from_bits(bits: u64) -> f64 {
    (bits >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
}

/// The finaliser of `SplitMix64`: a bijection in which every input bit affects every output bit.
fn mix(mut x: u64) -> u64 {
    x = x.wrapping_add(0x9E37_79B9_7F4A_7C15);
    x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    x ^ (x >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_of_different_purposes_differ_and_repeat() {
        let draw = |purpose, path: &[u64]| Stream::derive(7, purpose, path).bits();
        assert_eq!(draw("mutation", &[1, 2]), draw("mutation", &[1, 2]));
        assert_ne!(draw("mutation", &[1, 2]), draw("mutation", &[2, 1]));
        assert_ne!(draw("mutation", &[1]), draw("crossover", &[1]));
        assert_ne!(draw("mutation", &[0]), draw("mutation", &[0, 0]));
    }

    #[test]
    fn below_is_even() {
        let mut stream = Stream::derive(1, "test", &[]);
        let mut counts = [0u32; 5];
        (0..50_000).for_each(|_| counts[stream.below(5)] += 1);
        assert!(counts.iter().all(|&n| (9_600..10_400).contains(&n)), "{counts:?}");
    }

    #[test]
    fn every_order_comes_equally_often() {
        let mut stream = Stream::derive(1, "test", &[]);
        let mut counts = std::collections::BTreeMap::new();
        (0..24_000).for_each(|_| *counts.entry(stream.permutation(4)).or_insert(0) += 1);
        assert!(counts.len() == 24 && counts.values().all(|n| (850..1_150).contains(n)), "{counts:?}");
    }

    #[test]
    fn normal_has_mean_zero_and_variance_one() {
        let mut stream = Stream::derive(1, "test", &[]);
        let xs: Vec<f64> = (0..100_000).map(|_| stream.normal()).collect();
        let mean = xs.iter().sum::<f64>() / xs.len() as f64;
        let variance = xs.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / xs.len() as f64;
        assert!(mean.abs() < 0.02 && (variance - 1.0).abs() < 0.02, "{mean} {variance}");
    }
}
