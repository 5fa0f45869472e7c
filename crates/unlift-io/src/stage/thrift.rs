//! Thrift's compact form, in which Parquet writes its footer and the headers of its pages: walked
//! before the `parquet` crate trusts what is declared there.

/// Values in values at most: Parquet itself has seven.
const DEEPEST: u32 = 32;

/// The type of a value as it is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// True or false, which as a field have no bytes.
    Bool,
    Byte,
    /// Integers of 16 to 64 bits, which are written alike.
    Integer,
    Double,
    Bytes,
    List,
    Map,
    Struct,
    Uuid,
}

impl Kind {
    fn of(code: u8) -> Result<Self, Wrong> {
        Ok(match code {
            1 | 2 => Self::Bool,
            3 => Self::Byte,
            4..=6 => Self::Integer,
            7 => Self::Double,
            8 => Self::Bytes,
            9 | 10 => Self::List,
            11 => Self::Map,
            12 => Self::Struct,
            13 => Self::Uuid,
            other => return Err(Wrong::Content(format!("a value of type {other}"))),
        })
    }
}

/// Why bytes could not be walked.
#[derive(Debug)]
pub(super) enum Wrong {
    /// They end within a value.
    End,
    /// What was found.
    Content(String),
}

impl Wrong {
    /// For an error's `found`.
    pub(super) fn found(self) -> String {
        match self {
            Self::End => "one that is cut off".to_owned(),
            Self::Content(found) => found,
        }
    }
}

/// The field of a struct.
#[derive(Clone, Copy, Debug)]
pub(super) struct Field {
    pub(super) id: i64,
    pub(super) kind: Kind,
}

impl Field {
    /// Refuses another type than Parquet gives the field: its value would be read as something else.
    pub(super) fn expect(self, kind: Kind) -> Result<(), Wrong> {
        if self.kind == kind {
            return Ok(());
        }
        Err(Wrong::Content(format!("field {} of type {:?}", self.id, self.kind)))
    }
}

/// Bytes that are walked from the first to the last.
pub(super) struct Walk<'a> {
    rest: &'a [u8],
}

impl<'a> Walk<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes }
    }

    /// Bytes that were not walked yet.
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
        self.rest = &self.rest[1..];
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

    /// An integer.
    pub(super) fn integer(&mut self) -> Result<i64, Wrong> {
        let value = self.unsigned()?;
        Ok((value >> 1) as i64 ^ -((value & 1) as i64))
    }

    /// Begins a list; the type of its values, and how many there are: no more than bytes are left.
    pub(super) fn list(&mut self) -> Result<(Kind, u64), Wrong> {
        let head = self.byte()?;
        let n = match head >> 4 {
            15 => self.unsigned()?,
            n => u64::from(n),
        };
        if n == 0 {
            return Ok((Kind::Byte, 0));
        }
        if n > self.rest.len() as u64 {
            return Err(Wrong::End);
        }
        Ok((Kind::of(head & 15)?, n))
    }

    /// Walks a struct: `each` walks the value of a field and returns true, or leaves it to be skipped.
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
            if head & 15 == 0 {
                return Ok(());
            }
            let id = match head >> 4 {
                0 => self.integer()?,
                more => last + i64::from(more),
            };
            if i16::try_from(id).is_err() {
                return Err(Wrong::Content(format!("field {id}")));
            }
            last = id;
            let field = Field { id, kind: Kind::of(head & 15)? };
            // Of a truth value as a field, the head is all.
            if !each(self, field)? && field.kind != Kind::Bool {
                self.skip(field.kind, depth + 1)?;
            }
        }
    }

    fn skip(&mut self, kind: Kind, depth: u32) -> Result<(), Wrong> {
        if depth > DEEPEST {
            return Err(Wrong::Content(format!("values nested more than {DEEPEST} deep")));
        }
        match kind {
            Kind::Bool | Kind::Byte => self.pass(1),
            Kind::Integer => self.unsigned().map(drop),
            Kind::Double => self.pass(8),
            Kind::Uuid => self.pass(16),
            Kind::Bytes => {
                let n = self.unsigned()?;
                self.pass(n)
            }
            Kind::List => {
                let (kind, n) = self.list()?;
                (0..n).try_for_each(|_| self.skip(kind, depth + 1))
            }
            Kind::Map => {
                let n = self.unsigned()?;
                if n == 0 {
                    return Ok(());
                }
                let kinds = self.byte()?;
                let (key, value) = (Kind::of(kinds >> 4)?, Kind::of(kinds & 15)?);
                for _ in 0..n {
                    self.skip(key, depth + 1)?;
                    self.skip(value, depth + 1)?;
                }
                Ok(())
            }
            Kind::Struct => self.fields_within(depth, &mut |_, _| Ok(false)),
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
        let mut each = |walk: &mut Walk<'_>, field: Field| {
            seen.push((field.id, field.kind));
            if field.id == 1 {
                assert_eq!(walk.integer()?, -3);
            }
            Ok(field.id == 1)
        };
        walk.fields(&mut each).unwrap();
        assert_eq!(walk.remaining(), 0);
        let kinds = [(1, Kind::Integer), (2, Kind::Bool), (3, Kind::Bytes), (5, Kind::List)];
        assert_eq!(seen, kinds);

        let skip = |bytes: &[u8]| Walk::new(bytes).fields(|_, _| Ok(false));
        for end in 0..bytes.len() {
            assert!(matches!(skip(&bytes[..end]), Err(Wrong::End)), "{end}");
        }
        let deep = [0x1c; 5000];
        let Err(Wrong::Content(found)) = skip(&deep) else { panic!("5000 structs in structs") };
        assert_eq!(found, "values nested more than 32 deep");
        // Lists of lists as well, and counts that nothing follows.
        assert!(matches!(
            skip(&[[0x19; 1], [0x19; 1]].concat().repeat(90)),
            Err(Wrong::Content(_))
        ));
        assert!(matches!(skip(&[0x19, 0xf8, 0xff, 0xff, 0xff, 0xff, 7]), Err(Wrong::End)));
        assert!(matches!(skip(&[0x18, 0xff, 0xff, 0xff, 0xff, 7]), Err(Wrong::End)));
    }
}
