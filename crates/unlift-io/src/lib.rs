//! Files of unlift: reads maps ([`read`]), reads and writes features of images ([`features`]) and
//! stages ([`stage`]), and exports clouds ([`clouds`]).
//!
//! An error is one line that names the file, the place, what was expected and what was found. File
//! writes are atomic and replace only files that unlift wrote ([`atomic`]).
//!
//! ```
//! use unlift::obfuscate::{obfuscate, olc};
//! use unlift::{PointSet, Unit, seed::Key, truth::Original};
//! use unlift_io::{read, stage};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let folder = tempfile::tempdir()?;
//! # let folder = folder.path();
//! std::fs::write(folder.join("map.csv"), "x,y,z\n0,0,0\n1,0,0\n0,2,0\n0,0,3\n")?;
//! let map = read::open(&folder.join("map.csv"))?;
//! let original = Original::new(PointSet::try_new(map.positions, Unit::Meter)?);
//!
//! // The released data is public. The owner keeps the ground truth.
//! let (released, secret) = obfuscate(&olc::ENTRY, &original, None, &Key::from_seed(0))?;
//! stage::write_released(&folder.join("released.npz"), &released, Some("olc"))?;
//! stage::write_truth(&folder.join("truth.npz"), &original, &secret)?;
//! let read_again = stage::read_released::<3>(&folder.join("released.npz"))?;
//! assert_eq!(read_again.fingerprint(), released.fingerprint());
//!
//! // An error about bad input is one line.
//! std::fs::write(folder.join("bad.csv"), "x,y,z\n0,0\n")?;
//! let error = read::open(&folder.join("bad.csv")).unwrap_err().to_string();
//! assert!(error.contains("bad.csv:2: ") && error.contains("expected") && error.contains("found"));
//! # Ok(())
//! # }
//! ```

pub mod atomic;
pub mod clouds;
mod error;
pub mod features;
pub mod hash;
pub mod input;
pub mod outputs;
pub mod read;
pub mod stage;

pub use error::Error;
