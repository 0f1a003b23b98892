//! Sobol' points: a sequence of points of which every beginning fills the unit box evenly (Sobol' 1967).
//!
//! The first 2ᵏ points are spread evenly: each of the 2ᵏ equal parts of each dimension holds one, and pairs of
//! dimensions are filled evenly too. Direction numbers are those of Joe and Kuo (2008, their set of criterion D⁽⁶⁾) for
//! the first 100 dimensions; further ones, of which they have tables as well, continue with the next primitive
//! polynomials and numbers drawn from the seed: each is filled as evenly by itself, only pairs of them are left to
//! chance. Points are scrambled as Owen (1995) has it, so that each seed gives points of its own that are uniform each
//! by itself.

use sesame_rng::{derive_seed, keyed_unit};

/// Bits of a coordinate that the sequence decides; what is finer is random.
const BITS: usize = 32;
/// How many values they tell apart.
const SCALE: f64 = 4_294_967_296.0;

/// A scrambled sequence of points with as many dimensions as are asked for.
#[derive(Debug, Clone)]
pub struct SobolPoints {
    seed: u64,
    /// Per dimension, what each bit of an index contributes.
    directions: Vec<[u32; BITS]>,
    /// The polynomial of the last dimension.
    polynomial: u32,
}

impl SobolPoints {
    /// The sequence of a seed.
    pub fn new(seed: u64) -> Self {
        SobolPoints { seed: derive_seed(seed, "sobol", &[]), directions: Vec::new(), polynomial: 1 }
    }

    /// A coordinate of the point of this index, in `0..1`.
    pub fn value(&mut self, dimension: usize, index: u32) -> f64 {
        while self.directions.len() <= dimension {
            self.add_dimension();
        }
        let directions = &self.directions[dimension];
        let point = (0..BITS).filter(|bit| index >> bit & 1 == 1).fold(0, |point, bit| point ^ directions[bit]);
        let within = keyed_unit(derive_seed(self.seed, "within", &[]), u64::from(index), dimension as u64);
        ((f64::from(self.scrambled(point, dimension)) + within) / SCALE).min(1.0 - f64::EPSILON / 2.0)
    }

    /// Flips each bit by a draw for the bits before it: so equal beginnings stay equal, and all halves, quarters and so
    /// on are exchanged at random.
    fn scrambled(&self, point: u32, dimension: usize) -> u32 {
        (0..BITS).fold(0, |flips, bit| {
            let before = if bit == 0 { 0 } else { u64::from(point >> (BITS - bit)) };
            let flip = derive_seed(self.seed, "scramble", &[dimension as u64, bit as u64, before]) >> 63 == 1;
            if flip { flips | 1 << (BITS - 1 - bit) } else { flips }
        }) ^ point
    }

    fn add_dimension(&mut self) {
        let dimension = self.directions.len();
        if dimension == 0 {
            // Van der Corput's sequence: the bits of the index, turned round.
            self.directions.push(std::array::from_fn(|bit| 1 << (BITS - 1 - bit)));
            return;
        }
        self.polynomial = next_primitive(self.polynomial);
        let degree = degree(self.polynomial);
        let mut numbers = [0u32; BITS];
        for (bit, number) in numbers.iter_mut().enumerate().take(degree) {
            // Any odd number below twice its bit's value will do.
            let drawn = derive_seed(self.seed, "direction", &[dimension as u64, bit as u64]) >> (63 - bit);
            *number = u32::try_from(drawn).expect("it has at most as many bits as the degree") | 1;
        }
        if let Some(known) = JOE_KUO.get(dimension - 1) {
            for (number, &known) in numbers.iter_mut().zip(*known) {
                *number = u32::from(known);
            }
        }
        for (bit, number) in numbers.iter_mut().enumerate().take(degree) {
            *number <<= BITS - 1 - bit;
        }
        for bit in degree..BITS {
            let oldest = numbers[bit - degree];
            numbers[bit] = (1..degree).fold(oldest ^ oldest >> degree, |number, back| {
                if self.polynomial >> (degree - back) & 1 == 1 { number ^ numbers[bit - back] } else { number }
            });
        }
        self.directions.push(numbers);
    }
}

fn degree(polynomial: u32) -> usize {
    polynomial.ilog2() as usize
}

/// The next polynomial over the field of two elements, coefficients as bits, that is primitive.
fn next_primitive(polynomial: u32) -> u32 {
    (polynomial + 1..u32::MAX).find(|&next| is_primitive(next)).expect("there is one of every degree")
}

/// Whether the powers of x run through all polynomials of a lesser degree.
fn is_primitive(polynomial: u32) -> bool {
    let degree = degree(polynomial);
    let mut power = 1u32;
    for exponent in 1u32.. {
        power <<= 1;
        if power >> degree & 1 == 1 {
            power ^= polynomial;
        }
        if power <= 1 {
            return power == 1 && exponent == (1 << degree) - 1;
        }
        if exponent >= 1 << degree {
            return false;
        }
    }
    false
}

/// The initial numbers of the dimensions after the first, of Joe and Kuo's set D⁽⁶⁾; their polynomials are the
/// primitive ones in ascending order.
#[rustfmt::skip]
const JOE_KUO: [&[u16]; 99] = [
    &[1], &[1, 3], &[1, 3, 1], &[1, 1, 1], &[1, 1, 3, 3], &[1, 3, 5, 13], &[1, 1, 5, 5, 17], &[1, 1, 5, 5, 5],
    &[1, 1, 7, 11, 19], &[1, 1, 5, 1, 1], &[1, 1, 1, 3, 11], &[1, 3, 5, 5, 31], &[1, 3, 3, 9, 7, 49],
    &[1, 1, 1, 15, 21, 21], &[1, 3, 1, 13, 27, 49], &[1, 1, 1, 15, 7, 5], &[1, 3, 1, 15, 13, 25],
    &[1, 1, 5, 5, 19, 61], &[1, 3, 7, 11, 23, 15, 103], &[1, 3, 7, 13, 13, 15, 69], &[1, 1, 3, 13, 7, 35, 63],
    &[1, 3, 5, 9, 1, 25, 53], &[1, 3, 1, 13, 9, 35, 107], &[1, 3, 1, 5, 27, 61, 31], &[1, 1, 5, 11, 19, 41, 61],
    &[1, 3, 5, 3, 3, 13, 69], &[1, 1, 7, 13, 1, 19, 1], &[1, 3, 7, 5, 13, 19, 59], &[1, 1, 3, 9, 25, 29, 41],
    &[1, 3, 5, 13, 23, 1, 55], &[1, 3, 7, 3, 13, 59, 17], &[1, 3, 1, 3, 5, 53, 69], &[1, 1, 5, 5, 23, 33, 13],
    &[1, 1, 7, 7, 1, 61, 123], &[1, 1, 7, 9, 13, 61, 49], &[1, 3, 3, 5, 3, 55, 33], &[1, 3, 1, 15, 31, 13, 49, 245],
    &[1, 3, 5, 15, 31, 59, 63, 97], &[1, 3, 1, 11, 11, 11, 77, 249], &[1, 3, 1, 11, 27, 43, 71, 9],
    &[1, 1, 7, 15, 21, 11, 81, 45], &[1, 3, 7, 3, 25, 31, 65, 79], &[1, 3, 1, 1, 19, 11, 3, 205],
    &[1, 1, 5, 9, 19, 21, 29, 157], &[1, 3, 7, 11, 1, 33, 89, 185], &[1, 3, 3, 3, 15, 9, 79, 71],
    &[1, 3, 7, 11, 15, 39, 119, 27], &[1, 1, 3, 1, 11, 31, 97, 225], &[1, 1, 1, 3, 23, 43, 57, 177],
    &[1, 3, 7, 7, 17, 17, 37, 71], &[1, 3, 1, 5, 27, 63, 123, 213], &[1, 1, 3, 5, 11, 43, 53, 133],
    &[1, 3, 5, 5, 29, 17, 47, 173, 479], &[1, 3, 3, 11, 3, 1, 109, 9, 69], &[1, 1, 1, 5, 17, 39, 23, 5, 343],
    &[1, 3, 1, 5, 25, 15, 31, 103, 499], &[1, 1, 1, 11, 11, 17, 63, 105, 183], &[1, 1, 5, 11, 9, 29, 97, 231, 363],
    &[1, 1, 5, 15, 19, 45, 41, 7, 383], &[1, 3, 7, 7, 31, 19, 83, 137, 221], &[1, 1, 1, 3, 23, 15, 111, 223, 83],
    &[1, 1, 5, 13, 31, 15, 55, 25, 161], &[1, 1, 3, 13, 25, 47, 39, 87, 257], &[1, 1, 1, 11, 21, 53, 125, 249, 293],
    &[1, 1, 7, 11, 11, 7, 57, 79, 323], &[1, 1, 5, 5, 17, 13, 81, 3, 131], &[1, 1, 7, 13, 23, 7, 65, 251, 475],
    &[1, 3, 5, 1, 9, 43, 3, 149, 11], &[1, 1, 3, 13, 31, 13, 13, 255, 487], &[1, 3, 3, 1, 5, 63, 89, 91, 127],
    &[1, 1, 3, 3, 1, 19, 123, 127, 237], &[1, 1, 5, 7, 23, 31, 37, 243, 289], &[1, 1, 5, 11, 17, 53, 117, 183, 491],
    &[1, 1, 1, 5, 1, 13, 13, 209, 345], &[1, 1, 3, 15, 1, 57, 115, 7, 33], &[1, 3, 1, 11, 7, 43, 81, 207, 175],
    &[1, 3, 1, 1, 15, 27, 63, 255, 49], &[1, 3, 5, 3, 27, 61, 105, 171, 305], &[1, 1, 5, 3, 1, 3, 57, 249, 149],
    &[1, 1, 3, 5, 5, 57, 15, 13, 159], &[1, 1, 1, 11, 7, 11, 105, 141, 225], &[1, 3, 3, 5, 27, 59, 121, 101, 271],
    &[1, 3, 5, 9, 11, 49, 51, 59, 115], &[1, 1, 7, 1, 23, 45, 125, 71, 419], &[1, 1, 3, 5, 23, 5, 105, 109, 75],
    &[1, 1, 7, 15, 7, 11, 67, 121, 453], &[1, 3, 7, 3, 9, 13, 31, 27, 449], &[1, 3, 1, 15, 19, 39, 39, 89, 15],
    &[1, 1, 1, 1, 1, 33, 73, 145, 379], &[1, 3, 1, 15, 15, 43, 29, 13, 483], &[1, 1, 7, 3, 19, 27, 85, 131, 431],
    &[1, 3, 3, 3, 5, 35, 23, 195, 349], &[1, 3, 3, 7, 9, 27, 39, 59, 297], &[1, 1, 3, 9, 11, 17, 13, 241, 157],
    &[1, 3, 7, 15, 25, 57, 33, 189, 213], &[1, 1, 7, 1, 9, 55, 73, 83, 217], &[1, 3, 3, 13, 19, 27, 23, 113, 249],
    &[1, 3, 5, 3, 23, 43, 3, 253, 479], &[1, 1, 5, 5, 11, 5, 45, 117, 217],
];

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn polynomials_are_those_of_the_published_table() {
        let mut polynomial = 1;
        let found: Vec<u32> = (0..99)
            .map(|_| {
                polynomial = next_primitive(polynomial);
                polynomial
            })
            .collect();
        // x + 1, x² + x + 1, x³ + x + 1, …: the degree and the inner coefficients of the table's rows.
        assert_eq!(found[..10], [3, 7, 11, 13, 19, 25, 37, 41, 47, 55]);
        assert_eq!(found[96..], [985, 995, 1001]);
        for (numbers, polynomial) in JOE_KUO.iter().zip(found) {
            assert_eq!(numbers.len(), degree(polynomial));
            assert!(numbers.iter().enumerate().all(|(bit, &m)| m % 2 == 1 && m < 2 << bit), "{numbers:?}");
        }
    }

    #[test]
    fn unscrambled_points_are_the_published_ones() {
        let mut points = SobolPoints::new(0);
        points.value(4, 0);
        let at = |dimension: usize, index: usize| {
            let directions = &points.directions[dimension];
            let sum = (0..BITS).filter(|bit| index >> bit & 1 == 1).fold(0, |sum, bit| sum ^ directions[bit]);
            f64::from(sum) / SCALE
        };
        // By index, where the usual order is that of the Gray code.
        assert_eq!([1, 2, 3].map(|index| at(0, index)), [0.5, 0.25, 0.75]);
        assert_eq!([1, 2, 3].map(|index| at(1, index)), [0.5, 0.75, 0.25]);
        assert_eq!([1, 2, 3].map(|index| at(2, index)), [0.5, 0.75, 0.25]);
        assert_eq!([4, 5].map(|index| at(1, index)), [0.625, 0.125]);
        assert_eq!([4, 5].map(|index| at(2, index)), [0.375, 0.875]);
        // The fifth point in the usual order.
        assert_eq!([0, 1, 2].map(|dimension| at(dimension, 6)), [0.375, 0.375, 0.625]);
    }

    proptest! {
        #[test]
        fn the_first_points_are_stratified_in_each_dimension(
            power in 0u32..8, dimension in 0usize..300, seed: u64,
        ) {
            let mut points = SobolPoints::new(seed);
            let parts = 1u32 << power;
            let mut strata: Vec<u32> = (0..parts)
                .map(|index| {
                    let value = points.value(dimension, index);
                    (0..parts).rev().find(|&part| f64::from(part) <= value * f64::from(parts)).unwrap()
                })
                .collect();
            strata.sort_unstable();
            prop_assert_eq!(strata, (0..parts).collect::<Vec<_>>());
        }

        #[test]
        fn the_first_two_dimensions_are_stratified_together(seed: u64, rows in 0u32..=6) {
            let mut points = SobolPoints::new(seed);
            let (rows, columns) = (f64::from(1u32 << rows), f64::from(64u32 >> rows));
            let mut boxes: Vec<(u64, u64)> = (0..64)
                .map(|index| {
                    let [x, y] = [points.value(0, index) * rows, points.value(1, index) * columns];
                    (libm::floor(x).to_bits(), libm::floor(y).to_bits())
                })
                .collect();
            boxes.sort_unstable();
            boxes.dedup();
            prop_assert_eq!(boxes.len(), 64, "one point in each of the boxes of equal size");
        }
    }
}
