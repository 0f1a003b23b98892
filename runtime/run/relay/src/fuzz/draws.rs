//! Random numbers that depend on the operation seed and on the message alone.

use sesame_rng as rng;

/// The random numbers of one operation for one message: each is a function of the key.
#[derive(Debug, Clone, Copy)]
pub struct KeyedRng {
    seed: u64,
    message: u64,
}

impl KeyedRng {
    /// The random numbers for the `index`th message on the `member`th wire of the operation.
    pub fn new(operation_seed: u64, member: u64, index: u64) -> Self {
        let seed = if member == 0 { operation_seed } else { rng::derive_seed(operation_seed, "member", &[member]) };
        KeyedRng { seed, message: index }
    }

    /// The `n`th number, uniform in `[0, 1)`.
    pub fn unit(self, n: u64) -> f64 {
        rng::keyed_unit(self.seed, self.message, n)
    }

    /// A standard normal number (Box–Muller) from the `n`th number and the next one.
    pub fn normal(self, n: u64) -> f64 {
        let radius = libm::sqrt(-2.0 * libm::log(1.0 - self.unit(n)));
        radius * libm::cos(std::f64::consts::TAU * self.unit(n + 1))
    }
}
