//! Arguments of `features` and `invert`.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::Args;
use unlift_vision::network::DescriptorKind;

use crate::values;

/// Options of `features`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  unlift features photos --out features.h5
  unlift features photos --max-features 2048 --first-octave 0
  unlift features photos --type aliked --out features.h5
  unlift features PROJECT/database.db --out features.h5

Photos are JPEG, PNG or WebP files at any depth of the folder. Images are named by their path in the
folder. sift computes the features of COLMAP: RootSIFT descriptors times 512, as bytes. aliked and
superpoint compute descriptors of length 1, as floats. If IMAGES is a file, its features are copied.

Photos are turned upright by their EXIF orientation, and keypoints are in pixels of the upright
photo. The output file states this: the attribute \"upright\" of its keypoints is 1. COLMAP and hloc
do not turn photos: use --as-stored for them.

To resume an interrupted run, repeat the command. Finished images are kept in FILE.parts until FILE
is complete. If an image cannot be used, unlift prints a line on stderr and writes the others.

Exit codes: 0 done, 2 wrong usage, 3 bad input (at least one image).")]
pub struct FeaturesArgs {
    /// A folder of photos, hloc's features.h5, or a COLMAP database.db
    #[arg(value_name = "IMAGES")]
    pub images: PathBuf,
    /// HDF5 file to write, in hloc's layout
    #[arg(long, value_name = "FILE", default_value = "features.h5")]
    pub out: PathBuf,
    /// Replace files of the same name that unlift did not write
    #[arg(long)]
    pub force: bool,
    /// Features to extract: sift, aliked, or superpoint, whose weights you supply (see unlift
    /// models) [default: sift]
    #[arg(long = "type", value_name = "TYPE", value_parser = values::feature_type)]
    pub kind: Option<DescriptorKind>,
    /// Number of features per photo. aliked and superpoint keep the N best. sift keeps whole
    /// scales, the coarsest first, and stops after the scale that exceeds N, so it may return more
    /// than N [default: sift 8192, aliked 2048, superpoint 4096]
    #[arg(long, value_parser = values::count, value_name = "N")]
    pub max_features: Option<NonZeroUsize>,
    /// Keep only keypoints whose score exceeds SCORE; not for sift [default: aliked 0.2, superpoint
    /// 0.005]
    #[arg(long, value_name = "SCORE", value_parser = values::score)]
    pub min_score: Option<f32>,
    /// Leave photos as they are stored, as COLMAP and hloc do. Without this option, photos are
    /// turned upright by their EXIF orientation
    #[arg(long)]
    pub as_stored: bool,
    /// Shrink photos whose longer side exceeds PIXELS; keypoints stay in pixels of the original
    /// photo [default: sift 3200, others 1600]
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(16..=65536))]
    pub max_image_size: Option<u32>,
    /// Octave at which sift begins: -1 doubles the photo first and finds the finest features; 0
    /// uses the photo as it is and takes a third of the time [default: -1]
    #[arg(long, value_name = "OCTAVE", allow_hyphen_values = true,
          value_parser = clap::value_parser!(i8).range(-1..=0))]
    pub first_octave: Option<i8>,
    /// Number of threads; results do not depend on it [default: one per core]
    #[arg(long, value_parser = values::threads, value_name = "N")]
    pub threads: Option<NonZeroUsize>,
    /// Show no progress on stderr
    #[arg(long)]
    pub quiet: bool,
}

/// Options of `invert`.
#[derive(Debug, Args)]
#[command(after_help = "\
unlift writes one PNG per image, half as large as the image. The picture of a.jpg is a.jpg.png.
unlift models lists the networks.

Examples:
  unlift invert photos --out pictures
  unlift invert hidden/released.parquet --recovered back.parquet --out pictures
  unlift invert hidden/released.parquet --recovered back.parquet --cameras MODEL --scale 1")]
pub struct InvertArgs {
    /// A folder of photos, hloc's features.h5, a COLMAP database.db, or the released.parquet of a
    /// map or of images
    #[arg(value_name = "PATH")]
    pub path: PathBuf,
    /// Features to extract from photos: sift, aliked, or superpoint, whose weights you supply (see
    /// unlift models) [default: sift]
    #[arg(long, value_name = "TYPE", value_parser = values::feature_type)]
    pub features: Option<DescriptorKind>,
    /// Output file of unlift recover for PATH; required if PATH is a released.parquet. Without it,
    /// unlift paints six views from the center of a sphere cloud
    #[arg(long, value_name = "FILE")]
    pub recovered: Option<PathBuf>,
    /// COLMAP model with the cameras from which to paint the map; only if PATH is a released map
    #[arg(long, value_name = "MODEL", requires = "recovered", requires = "scale")]
    pub cameras: Option<PathBuf>,
    /// The --scale given to unlift obfuscate: units of the released map per unit of MODEL
    #[arg(long, value_name = "SCALE", value_parser = values::positive, requires = "cameras")]
    pub scale: Option<f64>,
    /// ONNX file of the network that paints, as written by the scripts in the repository's folder
    /// training/inversion [default: the network for these descriptors, see unlift models]
    #[arg(long, value_name = "FILE")]
    pub inverter: Option<PathBuf>,
    /// Paint at most N images: evenly spaced by name or, if PATH is a released.parquet of images,
    /// the first N
    #[arg(long, value_parser = values::count, value_name = "N")]
    pub max_images: Option<NonZeroUsize>,
    /// Number of threads; results do not depend on it [default: one per core]
    #[arg(long, value_parser = values::threads, value_name = "N")]
    pub threads: Option<NonZeroUsize>,
    /// Folder for the pictures
    #[arg(long, value_name = "DIR", default_value = "unlift-pictures")]
    pub out: PathBuf,
    /// Replace files of the same names that unlift did not write
    #[arg(long)]
    pub force: bool,
}
