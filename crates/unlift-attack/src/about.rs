//! The released map and the row order of lists and positions.
//!
//! They travel with the data up to the evaluation, so that positions are not compared with the truth of another map or order.

use std::fmt;

use crate::Error;

/// The hash of a released map, see [`Released::fingerprint`](crate::released::Released::fingerprint).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Fingerprint(pub [u8; 16]);

impl Fingerprint {
    /// Reads 32 hexadecimal digits; `None` for any other text.
    pub fn from_hex(text: &str) -> Option<Self> {
        let is_hex = text.len() == 32 && text.bytes().all(|digit| digit.is_ascii_hexdigit());
        u128::from_str_radix(text, 16).ok().filter(|_| is_hex).map(|bits| Self(bits.to_be_bytes()))
    }

    /// Rejects the fingerprint of another map. A missing one is accepted.
    ///
    /// # Errors
    /// When `found` is that of another map.
    pub fn expect(self, found: Option<Self>) -> Result<(), Error> {
        let Some(other) = found.filter(|found| *found != self) else { return Ok(()) };
        Err(Error::new("fingerprint", format!("{self}, that of the released map"), other))
    }
}

impl fmt::Display for Fingerprint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:032x}", u128::from_be_bytes(self.0))
    }
}

/// The order of rows. It matters only for records with two points (paired lines).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RowOrder {
    /// Row `s` is slot `s` of the secret: lists of the oracle, and lists that an owner gives by point.
    Slots,
    /// Row `s` is descriptor row `s`: lists made by comparing descriptors.
    DescriptorRows,
    /// The two rows of a record belong to its two points in unknown order: lists made from records alone.
    Either,
    /// Not stated, in a file of another program.
    #[default]
    Unstated,
}

impl RowOrder {
    /// The orders that a file can state.
    pub const STATED: [RowOrder; 3] = [Self::Slots, Self::DescriptorRows, Self::Either];

    /// Name in files; `None` for an order that is not stated.
    pub fn name(self) -> Option<&'static str> {
        match self {
            Self::Slots => Some("slots"),
            Self::DescriptorRows => Some("descriptor_rows"),
            Self::Either => Some("either"),
            Self::Unstated => None,
        }
    }

    /// Returns the order called `name`, if there is one.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::STATED.into_iter().find(|order| order.name() == Some(name))
    }
}

/// The released map, row order and origin of lists, or of positions made from them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct About {
    /// The released map, if it is known.
    pub map: Option<Fingerprint>,
    /// The order of rows.
    pub order: RowOrder,
    /// Whether the lists are stated to be the oracle's: true neighbors, and wrong ones drawn at random.
    pub by_oracle: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hexadecimal_digits_are_read_back() {
        let print = Fingerprint(std::array::from_fn(|at| 17 * at as u8));
        assert_eq!(Fingerprint::from_hex(&print.to_string()), Some(print));
        for wrong in ["", "0", &"0".repeat(31), &"0".repeat(33), &"g".repeat(32), &"é".repeat(16)]
        {
            assert_eq!(Fingerprint::from_hex(wrong), None, "{wrong}");
        }
    }
}
