//! Bytes of a fuzzer, read from the front. Missing bytes are 0, so that every input is valid.

/// Rest of an input.
pub struct Bytes<'a>(pub &'a [u8]);

impl<'a> Bytes<'a> {
    /// Returns the next byte.
    pub fn byte(&mut self) -> u8 {
        let Some((&first, rest)) = self.0.split_first() else { return 0 };
        self.0 = rest;
        first
    }

    /// Returns the next number of two bytes.
    pub fn short(&mut self) -> u16 {
        u16::from_le_bytes([self.byte(), self.byte()])
    }

    /// Returns a number, usually small, sometimes with any bits of a float.
    pub fn number(&mut self) -> f64 {
        match self.byte() {
            0 => {
                f64::from(f32::from_le_bytes([self.byte(), self.byte(), self.byte(), self.byte()]))
            }
            1 => f64::from(self.byte()),
            _ => f64::from(self.short() as i16) / 256.0,
        }
    }

    /// Returns the next `n` bytes, or as many as remain.
    pub fn take(&mut self, n: usize) -> &'a [u8] {
        let (taken, rest) = self.0.split_at(n.min(self.0.len()));
        self.0 = rest;
        taken
    }
}
