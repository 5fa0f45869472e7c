//! Encoding of a model's numbers as little-endian bytes.

use crate::Error;

/// Appends numbers without their count.
pub(crate) fn put(to: &mut Vec<u8>, numbers: &[f32]) {
    numbers.iter().for_each(|x| to.extend(x.to_le_bytes()));
}

/// Reads numbers from the front of a model's bytes.
#[derive(Debug)]
pub(crate) struct Reader<'a>(pub(crate) &'a [u8]);

impl<'a> Reader<'a> {
    fn bytes(&mut self, n: usize) -> Result<&'a [u8], Error> {
        let Some((front, rest)) = self.0.split_at_checked(n) else {
            let found = format!("{} bytes", self.0.len());
            return Err(Error::new("model", format!("{n} more bytes"), found));
        };
        self.0 = rest;
        Ok(front)
    }

    pub(crate) fn array<const N: usize>(&mut self) -> Result<[u8; N], Error> {
        let mut array = [0; N];
        array.copy_from_slice(self.bytes(N)?);
        Ok(array)
    }

    pub(crate) fn count(&mut self, most: usize) -> Result<usize, Error> {
        let n = u64::from_le_bytes(self.array()?);
        usize::try_from(n)
            .ok()
            .filter(|&n| n <= most)
            .ok_or_else(|| Error::new("model", format!("a count of at most {most}"), n.to_string()))
    }

    pub(crate) fn f32s(&mut self, n: usize) -> Result<Vec<f32>, Error> {
        let (rows, _) = self.bytes(n.saturating_mul(4))?.as_chunks::<4>();
        Ok(rows.iter().map(|&bytes| f32::from_le_bytes(bytes)).collect())
    }
}
