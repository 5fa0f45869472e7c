//! Arguments of `unlift invert`.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::Args;
use unlift_nn::DescriptorKind;

use crate::values;

/// Options of `invert`.
#[derive(Debug, Args)]
#[command(after_help = "\
One PNG per image, of half its size, under the image's name with .png behind. Networks: see
unlift models.

Examples:
  unlift invert photos --out pictures                                     of the keypoints themselves
  unlift invert hidden/released.parquet --recovered back.parquet --out pictures
  unlift invert hidden/released.parquet --recovered back.parquet --cameras PROJECT/sparse/0 --scale 1 \
    --out pictures                                                        of a map, by its cameras")]
pub struct InvertArgs {
    /// A folder of photos, hloc's features.h5, a COLMAP database.db, or released images or a released map
    /// (released.parquet)
    #[arg(value_name = "PATH")]
    pub path: PathBuf,
    /// Which features of photos: sift, aliked, or superpoint, whose weights you supply (see unlift
    /// models) [default: sift]
    #[arg(long, value_name = "TYPE", value_parser = values::feature_type)]
    pub features: Option<DescriptorKind>,
    /// What came back of the released images or map
    #[arg(long, value_name = "FILE")]
    pub recovered: Option<PathBuf>,
    /// Of a map: a COLMAP model whose cameras see it
    #[arg(long, value_name = "MODEL", requires = "recovered", requires = "scale")]
    pub cameras: Option<PathBuf>,
    /// Units of the released map per unit of that model: the --scale it was obfuscated with
    #[arg(long, value_name = "SCALE", value_parser = values::positive, requires = "cameras")]
    pub scale: Option<f64>,
    /// Paint with this network in place of the one known for the descriptors: ONNX, as
    /// training/inversion exports it
    #[arg(long, value_name = "FILE")]
    pub inverter: Option<PathBuf>,
    /// Paint at most this many images, evenly spaced over their names; of released images the first ones
    #[arg(long, value_parser = values::count, value_name = "N")]
    pub max_images: Option<NonZeroUsize>,
    /// Threads to use; never changes a result [default: one per core]
    #[arg(long, value_parser = values::threads, value_name = "N")]
    pub threads: Option<NonZeroUsize>,
    /// Folder to write
    #[arg(long, value_name = "DIR", default_value = "unlift-pictures")]
    pub out: PathBuf,
    /// Replace files of these names that unlift did not write
    #[arg(long)]
    pub force: bool,
}
