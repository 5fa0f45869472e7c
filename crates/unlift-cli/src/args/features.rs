//! Arguments of `unlift features`.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::Args;

/// Options of `features`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  unlift features photos --out features.h5
  unlift features photos --max-features 2048 --first-octave 0
  unlift features PROJECT/database.db --out features.h5

Photos are JPEG, PNG or WebP files at any depth, named relative to the folder. Features are SIFT as
COLMAP extracts it, descriptors bytes: RootSIFT times 512. Features of a file are copied, not
extracted.

A run that is interrupted goes on where it was when the same command is given again: finished images
wait in FILE.parts, which is gone when FILE is there. An image that cannot be used gets one line;
the others are written, and the exit code is 3.

Exit codes: 0 done, 2 usage, 3 bad input, be it a single image.")]
pub struct FeaturesArgs {
    /// A folder of photos, hloc's features.h5, or a COLMAP database.db
    #[arg(value_name = "IMAGES")]
    pub images: PathBuf,
    /// File to write (HDF5, hloc's layout)
    #[arg(long, value_name = "FILE", default_value = "features.h5")]
    pub out: PathBuf,
    /// Replace files of that name that unlift did not write
    #[arg(long)]
    pub force: bool,
    /// Features wanted per photo; coarse ones first, and the last scale is kept whole [default: 8192]
    #[arg(long, value_name = "N")]
    pub max_features: Option<NonZeroUsize>,
    /// Longest side in pixels; larger photos are shrunk, their keypoints are in pixels of the photo
    /// [default: 3200]
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(16..=65536))]
    pub max_image_size: Option<u32>,
    /// -1 doubles the photo first and finds the finest features, 0 does not and takes a third of the
    /// time [default: -1]
    #[arg(long, value_name = "OCTAVE", allow_hyphen_values = true,
          value_parser = clap::value_parser!(i8).range(-1..=0))]
    pub first_octave: Option<i8>,
    /// Threads to use; never changes a byte [default: one per core]
    #[arg(long, value_name = "N")]
    pub threads: Option<NonZeroUsize>,
    /// No progress on stderr
    #[arg(long)]
    pub quiet: bool,
}
