//! Checks the layout of an ONNX file before the loader reads it: the loader waits forever on a
//! number without an end, and follows nested graphs to any depth.

/// Maximum nesting of messages; ONNX without nested graphs needs less.
const MOST_DEEP: u32 = 64;
/// Maximum number of nodes, because the loader recurses over them. Networks of hundreds of layers
/// have fewer.
const MOST_NODES: u32 = 4096;
/// Maximum number of bytes of a number.
const MOST_LONG: usize = 10;

/// The content of a field.
#[derive(Clone, Copy)]
enum Inside {
    Message(&'static Message),
    /// Packed numbers of any length.
    Numbers,
}

/// The fields of a message with messages or packed numbers inside, by number.
struct Message(&'static [(u64, Inside)]);

const fn of(message: &'static Message) -> Inside {
    Inside::Message(message)
}

static TEXTS: Message = Message(&[]);
static DIMENSIONS: Message = Message(&[(1, of(&TEXTS))]);
static TENSOR_TYPE: Message = Message(&[(2, of(&DIMENSIONS))]);
static TYPE: Message = Message(&[
    (1, of(&TENSOR_TYPE)),
    (4, of(&SEQUENCE_TYPE)),
    (5, of(&MAP_TYPE)),
    (8, of(&TENSOR_TYPE)),
    (9, of(&SEQUENCE_TYPE)),
]);
static SEQUENCE_TYPE: Message = Message(&[(1, of(&TYPE))]);
static MAP_TYPE: Message = Message(&[(2, of(&TYPE))]);
static VALUE: Message = Message(&[(2, of(&TYPE)), (4, of(&TEXTS))]);
static TENSOR: Message = Message(&[
    (1, Inside::Numbers),
    (5, Inside::Numbers),
    (7, Inside::Numbers),
    (11, Inside::Numbers),
    (13, of(&TEXTS)),
    (16, of(&TEXTS)),
]);
static SPARSE: Message = Message(&[(1, of(&TENSOR)), (2, of(&TENSOR)), (3, Inside::Numbers)]);
static ATTRIBUTE: Message = Message(&[
    (5, of(&TENSOR)),
    (6, of(&GRAPH)),
    (8, Inside::Numbers),
    (10, of(&TENSOR)),
    (11, of(&GRAPH)),
    (14, of(&TYPE)),
    (15, of(&TYPE)),
    (22, of(&SPARSE)),
    (23, of(&SPARSE)),
]);
static NODE: Message = Message(&[(5, of(&ATTRIBUTE)), (9, of(&TEXTS))]);
static GRAPH: Message = Message(&[
    (1, of(&NODE)),
    (5, of(&TENSOR)),
    (11, of(&VALUE)),
    (12, of(&VALUE)),
    (13, of(&VALUE)),
    (15, of(&SPARSE)),
    (16, of(&TEXTS)),
]);
static MODEL: Message = Message(&[(7, of(&GRAPH)), (8, of(&TEXTS)), (14, of(&TEXTS))]);

/// Checks everything that the loader of models reads.
///
/// # Errors
/// Describes the fault, and its byte.
pub fn check(bytes: &[u8]) -> Result<(), String> {
    Walk { bytes, at: 0, n_nodes: 0 }.message(&MODEL, bytes.len(), 0)
}

struct Walk<'a> {
    bytes: &'a [u8],
    at: usize,
    n_nodes: u32,
}

impl Walk<'_> {
    /// Checks a message that ends at `end`.
    fn message(&mut self, message: &Message, end: usize, deep: u32) -> Result<(), String> {
        if deep > MOST_DEEP {
            return Err(format!("parts nested more than {MOST_DEEP} deep at byte {}", self.at));
        }
        self.n_nodes += u32::from(std::ptr::eq(message, &NODE));
        if self.n_nodes > MOST_NODES {
            return Err(format!("more than {MOST_NODES} nodes"));
        }
        while self.at < end {
            let tag = self.number(end)?;
            match tag & 7 {
                0 => drop(self.number(end)?),
                1 => self.skip(8, end)?,
                2 => {
                    let length = self.number(end)?;
                    let (from, field) = (self.at, tag >> 3);
                    self.skip(length, end)?;
                    let inside = message.0.iter().find(|(number, _)| *number == field);
                    let to = std::mem::replace(&mut self.at, from);
                    match inside.map(|(_, inside)| *inside) {
                        Some(Inside::Message(message)) => self.message(message, to, deep + 1)?,
                        Some(Inside::Numbers) => {
                            while self.at < to {
                                self.number(to)?;
                            }
                        }
                        None => self.at = to,
                    }
                }
                5 => self.skip(4, end)?,
                kind => return Err(format!("a field of kind {kind} at byte {}", self.at)),
            }
        }
        Ok(())
    }

    /// Reads a number of 7 bits per byte, before `end`.
    fn number(&mut self, end: usize) -> Result<u64, String> {
        let rest = &self.bytes[self.at..end];
        let length = 1 + rest.iter().take(MOST_LONG).take_while(|byte| **byte >= 0x80).count();
        // The tenth byte has room for one bit.
        let fits = length < MOST_LONG || length == MOST_LONG && rest.get(MOST_LONG - 1) == Some(&1);
        if length > rest.len() || !fits {
            return Err(format!("a number without end at byte {}", self.at));
        }
        self.at += length;
        let bits = rest[..length].iter().enumerate();
        Ok(bits.fold(0, |number, (at, byte)| number | u64::from(byte & 0x7f) << (7 * at)))
    }

    fn skip(&mut self, length: u64, end: usize) -> Result<(), String> {
        let left = (end - self.at) as u64;
        if length > left {
            return Err(format!(
                "{length} bytes declared where {left} are left, at byte {}",
                self.at
            ));
        }
        self.at += length as usize;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::network::MODELS;

    #[test]
    fn models_pass_and_what_is_cut_short_does_not() {
        for bytes in MODELS.iter().filter_map(|entry| entry.carried) {
            assert_eq!(check(bytes), Ok(()));
            let error = check(&bytes[..bytes.len() - 1]).unwrap_err();
            assert!(error.contains("declared where"), "{error}");
        }
        assert_eq!(check(b"text"), Err("a field of kind 4 at byte 1".to_owned()));
    }

    #[test]
    fn numbers_end() {
        // Found by fuzzing: ten bytes that all have the continuation bit.
        let found = [0xff, 0xff, 0xff, 0xb3, 0xb3, 0xb3, 0xb3, 0xb3, 0xff, 0xff, 0xff];
        assert_eq!(check(&found), Err("a number without end at byte 0".to_owned()));
        let largest = [&[0x08][..], &[0xff; 9], &[1]].concat();
        assert_eq!(check(&largest), Ok(()));
        assert!(check(&[&[0x08][..], &[0xff; 9], &[2]].concat()).is_err());
        // This fault within a tensor's numbers, in a graph.
        let tensor = [&[7 << 3 | 2, 10][..], &[0xff; 10]].concat();
        let graph = [&[5 << 3 | 2, 12][..], &tensor].concat();
        let model = [&[7 << 3 | 2, 14][..], &graph].concat();
        assert_eq!(check(&model), Err("a number without end at byte 6".to_owned()));
    }

    #[test]
    fn graphs_within_graphs_end() {
        let field = |number: u8, inside: Vec<u8>| {
            let mut bytes = vec![number << 3 | 2];
            let mut length = inside.len();
            while length >= 0x80 {
                bytes.push(length as u8 | 0x80);
                length >>= 7;
            }
            [bytes, vec![length as u8], inside].concat()
        };
        let nested = |n: usize| {
            let graph = (0..n).fold(Vec::new(), |graph, _| field(1, field(5, field(6, graph))));
            field(7, graph)
        };
        assert_eq!(check(&nested(20)), Ok(()));
        assert!(check(&nested(30)).unwrap_err().contains("nested more than 64 deep"));
    }
}
