//! Arguments of `features`, `invert` and `metrics`.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::Args;
use unlift_nn::DescriptorKind;

use crate::values;

/// Options of `features`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  unlift features photos --out features.h5
  unlift features photos --max-features 2048 --first-octave 0
  unlift features photos --type aliked --out features.h5
  unlift features PROJECT/database.db --out features.h5

Photos are JPEG, PNG or WebP files at any depth of the folder, and are named relative to it. sift is
as in COLMAP; its descriptors are bytes, RootSIFT times 512. Descriptors of aliked and superpoint
are floats of length 1. Features of a file are copied, not extracted.

Photos are turned upright by their EXIF orientation, and keypoints are in pixels of the upright
photo. The file records this in the attribute upright of keypoints. COLMAP and hloc do not turn
photos: for them, use --as-stored.

To resume an interrupted run, repeat the command. Finished images wait in FILE.parts, which is
removed when FILE is complete. An image that cannot be used gets one line on stderr. The others are
written, and the exit code is 3.

Exit codes: 0 done, 2 wrong usage, 3 bad input, even of a single image.")]
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
    /// Number of features per photo. sift takes the coarsest and completes the last scale, so it
    /// may exceed N; the others take the best [default: 8192, aliked 2048, superpoint 4096]
    #[arg(long, value_parser = values::count, value_name = "N")]
    pub max_features: Option<NonZeroUsize>,
    /// Keep only keypoints whose score exceeds this; not for sift [default: aliked 0.2, superpoint
    /// 0.005]
    #[arg(long, value_name = "SCORE", value_parser = values::score)]
    pub min_score: Option<f32>,
    /// Leave photos as they are stored, as COLMAP and hloc do. Without it, they are turned upright
    /// by their EXIF orientation
    #[arg(long)]
    pub as_stored: bool,
    /// Shrink photos whose longer side exceeds this; keypoints stay in pixels of the original photo
    /// [default: sift 3200, others 1600]
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(16..=65536))]
    pub max_image_size: Option<u32>,
    /// Octave at which sift begins. -1 doubles the photo and finds the finest features; 0 does not
    /// and takes a third of the time [default: -1]
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
Writes one PNG per image, half as large, and named like the image with .png appended. unlift models
lists the networks.

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
    /// Points recovered from PATH, as unlift recover writes them
    #[arg(long, value_name = "FILE")]
    pub recovered: Option<PathBuf>,
    /// COLMAP model whose cameras see the map; for maps only
    #[arg(long, value_name = "MODEL", requires = "recovered", requires = "scale")]
    pub cameras: Option<PathBuf>,
    /// Units of the released map per unit of the COLMAP model: the --scale given to unlift
    /// obfuscate
    #[arg(long, value_name = "SCALE", value_parser = values::positive, requires = "cameras")]
    pub scale: Option<f64>,
    /// Network that paints, in place of the one for these descriptors: an ONNX file as
    /// training/inversion exports it
    #[arg(long, value_name = "FILE")]
    pub inverter: Option<PathBuf>,
    /// Paint at most N images, evenly spaced over their names; of released images, the first N
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

/// Options of `metrics`.
#[derive(Debug, Args)]
#[command(after_help = "\
SSIM is that of scikit-image by default (7 x 7 windows, mean of the colors). PSNR is in dB. LPIPS is
version 0.1 on SqueezeNet. In folders, pictures of the same name are compared, whatever their
extension. A picture of twice the other's size is halved first.

Examples:
  unlift metrics photo.jpg picture.png
  unlift metrics photos pictures --json")]
pub struct MetricsArgs {
    /// A picture, or a folder of pictures
    pub a: PathBuf,
    /// Another picture of the same, half or twice the size, or a folder of such pictures
    pub b: PathBuf,
    /// Print JSON with ssim, psnr and lpips in place of the text; for folders, the means, and
    /// `pictures` with the values of each
    #[arg(long)]
    pub json: bool,
}
