//! Arguments of `unlift obfuscate`.

use super::map::MapArgs;
use crate::values;
use clap::Args;
use std::path::PathBuf;
use unlift::obfuscate::Entry;

/// Options of `obfuscate`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  unlift obfuscate PROJECT --scheme ppl --scale 1 --out hidden
  unlift obfuscate PROJECT --scheme olc --descriptors PROJECT/database.db --out hidden
  unlift obfuscate features.h5 --scheme dcl2d --out hidden-images

Writes hidden/released.parquet (what an attacker sees) and hidden/truth.parquet (keep it private).
What is drawn comes from a fresh 256-bit key that is kept nowhere. With --seed it comes from that
number, for experiments only: whoever guesses it undoes the order of the records, and cp entirely.
Release a map once: of two releases with descriptors, records of the same point meet in it.")]
pub struct ObfuscateArgs {
    /// A map as audit map reads it: a COLMAP model or project folder, a .ply, .csv or .npy file; of images hloc's features.h5, a
    /// COLMAP database.db, or a folder of photos
    #[arg(value_name = "PATH")]
    pub path: PathBuf,
    /// The scheme, see unlift schemes; those for images take features of images
    #[arg(long, value_name = "SCHEME", value_parser = values::any_scheme)]
    pub scheme: &'static Entry,
    /// Folder for released.parquet and truth.parquet; whatever else is in it stays
    #[arg(long, value_name = "DIR", default_value = "unlift-obfuscated")]
    pub out: PathBuf,
    /// Replace files of that name that unlift did not write
    #[arg(long)]
    pub force: bool,
    #[command(flatten)]
    pub map: MapArgs,
}
