//! Parses Thrift's compact protocol, the encoding of Parquet's footer and page headers.
//!
//! The `parquet` crate recurses and allocates as these declare, and gives no access to page
//! headers.

/// Parquet itself has seven levels.
const DEEPEST: u32 = 32;

/// A boolean field is stored in its type alone.
const BOOLS: [u8; 2] = [1, 2];
const LIST: u8 = 9;
const STRUCT: u8 = 12;

#[derive(Debug)]
pub(super) enum Wrong {
    End,
    Content(String),
}

impl Wrong {
    pub(super) fn found(self) -> String {
        match self {
            Self::End => "one that is cut off".to_owned(),
            Self::Content(found) => found,
        }
    }
}

/// The number and the type of a struct field.
pub(super) type Field = (i64, u8);

/// Values of a wrong type would be misread.
fn expect(is_right: bool, kind: u8) -> Result<(), Wrong> {
    if is_right { Ok(()) } else { Err(Wrong::Content(format!("a value of type {kind}"))) }
}

pub(super) struct Walk<'a> {
    rest: &'a [u8],
}

impl<'a> Walk<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes }
    }

    pub(super) fn remaining(&self) -> usize {
        self.rest.len()
    }

    fn pass(&mut self, n: u64) -> Result<(), Wrong> {
        let n = usize::try_from(n).map_err(|_| Wrong::End)?;
        self.rest = self.rest.get(n..).ok_or(Wrong::End)?;
        Ok(())
    }

    fn byte(&mut self) -> Result<u8, Wrong> {
        let byte = *self.rest.first().ok_or(Wrong::End)?;
        self.pass(1)?;
        Ok(byte)
    }

    fn unsigned(&mut self) -> Result<u64, Wrong> {
        let mut value = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            value |= u64::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return Ok(value);
            }
        }
        Err(Wrong::Content("a number of more than 64 bits".to_owned()))
    }

    fn signed(&mut self) -> Result<i64, Wrong> {
        let value = self.unsigned()?;
        Ok((value >> 1) as i64 ^ -((value & 1) as i64))
    }

    pub(super) fn integer(&mut self, kind: u8) -> Result<i64, Wrong> {
        expect((4..=6).contains(&kind), kind)?;
        self.signed()
    }

    /// Starts a list of at most `most` structs and returns their number. Errors name them `what`.
    pub(super) fn structs(&mut self, kind: u8, most: u64, what: &str) -> Result<u64, Wrong> {
        expect(kind == LIST, kind)?;
        let (kind, n) = self.list()?;
        if n > most {
            return Err(Wrong::Content(format!("{n} {what}, more than {most}")));
        }
        expect(n == 0 || kind == STRUCT, kind)?;
        Ok(n)
    }

    /// Returns the type and the number of values of a list. The remaining bytes limit the number.
    fn list(&mut self) -> Result<(u8, u64), Wrong> {
        let head = self.byte()?;
        let n = match head >> 4 {
            15 => self.unsigned()?,
            n => u64::from(n),
        };
        if n > self.rest.len() as u64 {
            return Err(Wrong::End);
        }
        Ok((head & 15, n))
    }

    pub(super) fn structure(
        &mut self,
        kind: u8,
        each: impl FnMut(&mut Self, Field) -> Result<bool, Wrong>,
    ) -> Result<(), Wrong> {
        expect(kind == STRUCT, kind)?;
        self.fields(each)
    }

    /// Parses a struct. `each` parses the value of a field and returns true, or returns false to
    /// skip it.
    pub(super) fn fields(
        &mut self,
        mut each: impl FnMut(&mut Self, Field) -> Result<bool, Wrong>,
    ) -> Result<(), Wrong> {
        self.fields_within(0, &mut each)
    }

    fn fields_within(
        &mut self,
        depth: u32,
        each: &mut dyn FnMut(&mut Self, Field) -> Result<bool, Wrong>,
    ) -> Result<(), Wrong> {
        let mut last = 0;
        loop {
            let head = self.byte()?;
            let kind = head & 15;
            if kind == 0 {
                return Ok(());
            }
            let id = match head >> 4 {
                0 => self.signed()?,
                more => last + i64::from(more),
            };
            if i16::try_from(id).is_err() {
                return Err(Wrong::Content(format!("field {id}")));
            }
            last = id;
            if !each(self, (id, kind))? && !BOOLS.contains(&kind) {
                self.skip(kind, depth + 1)?;
            }
        }
    }

    fn skip(&mut self, kind: u8, depth: u32) -> Result<(), Wrong> {
        if depth > DEEPEST {
            return Err(Wrong::Content(format!("values nested more than {DEEPEST} deep")));
        }
        match kind {
            // A boolean in a list, or a byte.
            1..=3 => self.pass(1),
            // Integers of 16 to 64 bits have the same encoding.
            4..=6 => self.unsigned().map(drop),
            // A double.
            7 => self.pass(8),
            // Text or binary.
            8 => {
                let n = self.unsigned()?;
                self.pass(n)
            }
            // A list or a set.
            LIST | 10 => {
                let (kind, n) = self.list()?;
                (0..n).try_for_each(|_| self.skip(kind, depth + 1))
            }
            // A map.
            11 => {
                let n = self.unsigned()?;
                let kinds = if n > 0 { self.byte()? } else { 0 };
                for _ in 0..n {
                    self.skip(kinds >> 4, depth + 1)?;
                    self.skip(kinds & 15, depth + 1)?;
                }
                Ok(())
            }
            STRUCT => self.fields_within(depth, &mut |_, _| Ok(false)),
            // A UUID.
            13 => self.pass(16),
            other => expect(false, other),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_walked_and_depth_and_lengths_are_bounded() {
        // Field 1: -3; field 2: true; field 3: "ab"; field 5: a list of two bytes; the end.
        let bytes = [0x16, 5, 0x11, 0x18, 2, b'a', b'b', 0x29, 0x23, 8, 9, 0];
        let mut seen = Vec::new();
        let mut walk = Walk::new(&bytes);
        walk.fields(|walk, (id, kind)| {
            seen.push((id, kind));
            if id == 1 {
                assert_eq!(walk.integer(kind)?, -3);
            }
            Ok(id == 1)
        })
        .unwrap();
        assert_eq!(walk.remaining(), 0);
        assert_eq!(seen, [(1, 6), (2, 1), (3, 8), (5, LIST)]);

        let skip = |bytes: &[u8]| Walk::new(bytes).fields(|_, _| Ok(false));
        for end in 0..bytes.len() {
            assert!(matches!(skip(&bytes[..end]), Err(Wrong::End)), "{end}");
        }
        let deep = [0x1c; 5000];
        let Err(Wrong::Content(found)) = skip(&deep) else { panic!("5000 structs in structs") };
        assert_eq!(found, "values nested more than 32 deep");
        // Nested lists, and counts without values.
        assert!(matches!(skip(&[0x19; 180]), Err(Wrong::Content(_))));
        assert!(matches!(skip(&[0x19, 0xf8, 0xff, 0xff, 0xff, 0xff, 7]), Err(Wrong::End)));
        assert!(matches!(skip(&[0x18, 0xff, 0xff, 0xff, 0xff, 7]), Err(Wrong::End)));
    }
}
