//! LZF, the compression of PCD files: literal runs, and copies of earlier bytes.

const LITERAL: u8 = 31;

/// Decompresses `packed` to exactly `n` bytes, or returns `None`.
pub fn unpacked(mut packed: &[u8], n: usize) -> Option<Vec<u8>> {
    let mut out: Vec<u8> = Vec::with_capacity(n);
    while let Some((&control, rest)) = packed.split_first() {
        if control <= LITERAL {
            let (run, rest) = rest.split_at_checked(usize::from(control) + 1)?;
            if run.len() > n - out.len() {
                return None;
            }
            out.extend_from_slice(run);
            packed = rest;
            continue;
        }
        // The length seven means that another length byte follows.
        let (longer, rest) = match control >> 5 {
            7 => rest.split_first().map(|(&longer, rest)| (usize::from(longer), rest))?,
            _ => (0, rest),
        };
        let (&low, rest) = rest.split_first()?;
        let length = usize::from(control >> 5) + longer + 2;
        let back = (usize::from(control & LITERAL) << 8) + usize::from(low) + 1;
        let start = out.len().checked_sub(back)?;
        if length > n - out.len() {
            return None;
        }
        // A copy may overlap its own output.
        for at in start..start + length {
            out.push(out[at]);
        }
        packed = rest;
    }
    (out.len() == n).then_some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_stand_there_or_are_copied() {
        assert_eq!(unpacked(&[2, b'a', b'b', b'c'], 3).unwrap(), b"abc");
        // A copy of three bytes from distance two overlaps its output.
        assert_eq!(unpacked(&[1, b'a', b'b', 0x20, 1], 5).unwrap(), b"ababa");
        // 7 + 3 + 2 bytes from distance one.
        let long = unpacked(&[0, b'x', 0xe0, 3, 0], 13).unwrap();
        assert_eq!(long, [b'x'; 13]);
    }

    #[test]
    fn what_is_too_long_too_short_or_before_the_start_is_none() {
        let packed = [1, b'a', b'b', 0x20, 1];
        assert!(unpacked(&packed, 4).is_none() && unpacked(&packed, 6).is_none());
        assert!(unpacked(&[0, b'a', 0x20, 1], 4).is_none());
        assert!(unpacked(&[5, b'a'], 6).is_none() && unpacked(&[0, b'a', 0xe0, 3], 13).is_none());
        assert_eq!(unpacked(&[], 0), Some(Vec::new()));
    }
}
