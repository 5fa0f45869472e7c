//! Files of unlift: maps in ([`read`]), features of images in and out ([`features`]), stages in and out
//! ([`stage`]), clouds out ([`clouds`]).
//!
//! Bad input gets one line that names the file, the place, what was expected and what was found;
//! outputs appear whole or not at all, and never in place of what is not theirs ([`atomic`]).
//!
//! ```
//! use unlift::obfuscate::{obfuscate, olc::Olc};
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
//! // What an attacker sees, and what its owner keeps.
//! let (released, secret) = obfuscate(&Olc, &original, None, &Key::from_seed(0))?;
//! stage::write_released(&folder.join("released.parquet"), &released)?;
//! stage::write_truth(&folder.join("truth.parquet"), &original, &secret)?;
//! let read_again = stage::read_released::<3>(&folder.join("released.parquet"))?;
//! assert_eq!(read_again.fingerprint(), released.fingerprint());
//!
//! // Bad input is one line.
//! std::fs::write(folder.join("bad.csv"), "x,y,z\n0,0\n")?;
//! let error = read::open(&folder.join("bad.csv")).unwrap_err().to_string();
//! assert!(error.contains("bad.csv:2: ") && error.contains("expected") && error.contains("found"));
//! # Ok(())
//! # }
//! ```

pub mod atomic;
pub mod clouds;
mod database;
mod error;
pub mod features;
mod guard;
pub mod hash;
pub mod input;
pub mod read;
pub mod seen;
pub mod stage;

pub use error::{Error, Place};
