//! Kinds of descriptors, detected from their values.

use std::borrow::Cow;

use crate::descriptors::Values;
use crate::neighbors::{Overlap, Source};
use crate::{Descriptors, Error, ErrorKind, named};

named! {
    /// Descriptors for which networks are trained.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum DescriptorKind {
        /// 128 nonnegative values: gradients of a patch, as `unlift features` and COLMAP write them.
        Sift = "sift",
        /// 128 floats that are not SIFT.
        Aliked = "aliked",
        /// 256 floats.
        SuperPoint = "superpoint",
    }
}

impl DescriptorKind {
    /// Detects the kind of `descriptors`. Other features of 128 floats are taken for ALIKED.
    ///
    /// # Errors
    /// If they are of no known kind; the error names `whose` they are.
    pub fn of(descriptors: &Descriptors, whose: &str) -> Result<Self, Error> {
        let is_sift = Source::<2>::takes(&Overlap, descriptors).is_ok();
        let floats = matches!(descriptors.values(), Values::F32(_));
        match (is_sift, floats, descriptors.dim()) {
            (true, ..) => Ok(Self::Sift),
            (false, true, 128) => Ok(Self::Aliked),
            (false, true, 256) => Ok(Self::SuperPoint),
            (false, _, dim) => {
                let expected = "descriptors of SIFT (128 values, none negative), ALIKED (128 floats) or SuperPoint (256 floats)";
                let found = format!("{dim} {}", if floats { "floats" } else { "bytes" });
                Err(Error::new(whose, expected, found).of_kind(ErrorKind::Descriptors))
            }
        }
    }

    /// Returns the kind called `name`: "sift", "aliked" or "superpoint".
    ///
    /// # Errors
    /// If there is none; the message lists all.
    pub fn from_name(name: &str) -> Result<Self, Error> {
        Self::named(name).ok_or_else(|| {
            let names = Self::ALL.map(Self::name).join(", ");
            Error::new("features", format!("one of {names}"), name)
        })
    }

    /// Returns the number of values of a descriptor.
    pub fn dim(self) -> usize {
        match self {
            Self::Sift | Self::Aliked => 128,
            Self::SuperPoint => 256,
        }
    }
}

/// Returns sets of descriptors as they are compared, in the form that the largest set needs: the square roots of SIFT that is not
/// RootSIFT, the bits of bit strings as 1 and -1, whose cosine follows from the Hamming distance, and others as they are.
pub(crate) fn comparable<'a>(sets: &[&'a Descriptors]) -> Vec<Cow<'a, Descriptors>> {
    let Some(largest) = sets.iter().max_by_key(|set| set.len()) else { return Vec::new() };
    let lacks_root = lacks_root(largest);
    let are_bits = matches!(largest.values(), Values::U8(bytes) if are_bits(bytes, largest.dim()));
    let are_bytes = sets.iter().all(|set| matches!(set.values(), Values::U8(_)));
    let bits = |&byte: &u8| (0..8).map(move |bit| f32::from(byte >> bit & 1) * 2.0 - 1.0);
    let owned = |values, dim| Cow::Owned(Descriptors::unchecked(Values::F32(values), dim));
    let of = |&set: &&'a Descriptors| match set.values() {
        _ if lacks_root => {
            owned(set.rows().flatten().map(|x| x.max(0.0).sqrt()).collect(), set.dim())
        }
        Values::U8(bytes) if are_bits && are_bytes => {
            owned(bytes.iter().flat_map(bits).collect(), 8 * set.dim())
        }
        _ => Cow::Borrowed(set),
    };
    sets.iter().map(of).collect()
}

/// Returns whether SIFT descriptors lack RootSIFT's square root.
///
/// SIFT cuts values at a fifth of the norm: without the root, the largest value of a row is a fifth or more.
fn lacks_root(descriptors: &Descriptors) -> bool {
    let is_below = |row: &Vec<f32>| {
        let largest = row.iter().copied().fold(0.0, f32::max);
        let squares: f32 = row.iter().map(|x| (x / largest) * (x / largest)).sum();
        squares > 25.0
    };
    let is_sift = Source::<2>::takes(&Overlap, descriptors).is_ok();
    is_sift && 20 * descriptors.rows().filter(is_below).count() < descriptors.len()
}

/// Returns whether rows of bytes are bit strings (ORB, BRIEF, AKAZE): bits of all weights are about as often 1 as 0, and rows differ in
/// length, from 0 and from the mean value. Numbers have rarely set high bits or rows of one length. Rows of 128 bytes are SIFT.
pub fn are_bits(bytes: &[u8], dim: usize) -> bool {
    let n = bytes.len() as f64;
    let is_balanced = |bit: u32| {
        let ones = bytes.iter().filter(|&&byte| byte >> bit & 1 == 1).count();
        (0.3..=0.7).contains(&(ones as f64 / n))
    };
    let differ = |from: f64| {
        let length2 = |row: &[u8]| row.iter().map(|&x| (f64::from(x) - from).powi(2)).sum::<f64>();
        let (sum, squares) =
            bytes.chunks_exact(dim).map(length2).fold((0.0, 0.0), |(s, q), x| (s + x, q + x * x));
        let rows = n / dim as f64;
        squares * rows > sum * sum * (1.0 + 0.05 * 0.05)
    };
    let mean = bytes.iter().map(|&x| f64::from(x)).sum::<f64>() / n;
    dim != DescriptorKind::Sift.dim() && (0..8).all(is_balanced) && differ(0.0) && differ(mean)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seed::{Draws, Stage};

    #[test]
    fn sift_is_compared_by_its_root_whatever_its_norm() {
        let mut draws = Draws::new(1, Stage::Synthetic, 0);
        // Gradients of a patch are skewed: a few are strong, and SIFT cuts these.
        let mut plain: Vec<f32> =
            (0..90 * 128).map(|_| (1.3 * draws.normal()).exp() as f32).collect();
        for row in plain.chunks_exact_mut(128) {
            let norm = row.iter().map(|x| x * x).sum::<f32>().sqrt();
            row.iter_mut().for_each(|x| *x = (*x / norm).min(0.2));
        }
        let root = |x: &f32| x.sqrt();
        let of = |values: Vec<f32>| Descriptors::try_new(Values::F32(values), 128).unwrap();
        let [rooted, plain] = [of(plain.iter().map(root).collect()), of(plain)];
        assert_eq!(*comparable(&[&plain])[0], rooted);
        assert_eq!(*comparable(&[&rooted])[0], rooted);
    }

    #[test]
    fn bit_strings_are_compared_by_their_bits_and_numbers_as_numbers() {
        let mut draws = Draws::new(2, Stage::Synthetic, 0);
        let mut bytes =
            |most: u64| -> Vec<u8> { (0..80 * 64).map(|_| draws.below(most) as u8).collect() };
        let of = |bytes: &[u8], dim| Descriptors::try_new(Values::U8(bytes.to_vec()), dim).unwrap();
        let (bits, low) = (bytes(256), bytes(90));
        for dim in [32, 64] {
            let compared = comparable(&[&of(&bits, dim)]).remove(0).into_owned();
            let all: u32 = (0..dim).map(|at| (bits[at] ^ bits[dim + at]).count_ones()).sum();
            assert_eq!(compared.dim(), 8 * dim);
            assert_eq!(compared.squared_distance(0, 1), 4.0 * all as f32);
            assert_eq!(*comparable(&[&of(&low, dim)])[0], of(&low, dim));
        }
        assert_eq!(comparable(&[&of(&bits, 128)])[0].dim(), 128);
    }

    #[test]
    fn descriptors_are_told_by_signs_and_columns() {
        let of = |values: Values, dim| {
            DescriptorKind::of(&Descriptors::try_new(values, dim).unwrap(), "mine")
        };
        let signed =
            |dim: usize| Values::F32((0..2 * dim).map(|at| 0.5 - (at / dim) as f32).collect());
        let sift = (0..256).map(|at| at as u8 % 7 + at as u8 / 128).collect();
        assert_eq!(of(Values::U8(sift), 128), Ok(DescriptorKind::Sift));
        assert_eq!(of(signed(128), 128), Ok(DescriptorKind::Aliked));
        assert_eq!(of(signed(256), 256), Ok(DescriptorKind::SuperPoint));
        for kind in DescriptorKind::ALL {
            assert_eq!(DescriptorKind::from_name(kind.name()), Ok(kind));
        }
    }
}
