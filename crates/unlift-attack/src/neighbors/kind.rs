//! Kinds of descriptors, detected from their values.

use crate::descriptors::Values;
use crate::neighbors::{Overlap, Source};
use crate::{Descriptors, Error, ErrorKind};

/// Descriptors for which networks are trained.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DescriptorKind {
    /// 128 nonnegative values: gradients of a patch, as `unlift features` and COLMAP write them.
    Sift,
    /// 128 floats that are not SIFT.
    Aliked,
    /// 256 floats.
    SuperPoint,
}

impl DescriptorKind {
    /// All kinds, in the order of their discriminants.
    pub const ALL: [Self; 3] = [Self::Sift, Self::Aliked, Self::SuperPoint];

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
        Self::ALL.into_iter().find(|kind| kind.name() == name).ok_or_else(|| {
            let names = Self::ALL.map(Self::name).join(", ");
            Error::new("features", format!("one of {names}"), name)
        })
    }

    /// Returns the name that users type.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sift => "sift",
            Self::Aliked => "aliked",
            Self::SuperPoint => "superpoint",
        }
    }

    /// Returns the number of values of a descriptor.
    pub fn dim(self) -> usize {
        match self {
            Self::Sift | Self::Aliked => 128,
            Self::SuperPoint => 256,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        let odd = of(signed(64), 64).unwrap_err().to_string();
        assert!(
            odd.starts_with("mine: expected descriptors of SIFT") && odd.ends_with("64 floats"),
            "{odd}"
        );
        for kind in DescriptorKind::ALL {
            assert_eq!(DescriptorKind::ALL[kind as usize], kind);
            assert_eq!(DescriptorKind::from_name(kind.name()), Ok(kind));
        }
    }
}
