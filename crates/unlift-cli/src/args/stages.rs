//! Arguments of the stages, of comparisons and tables, and of the demo.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::{Args, value_parser};
use unlift::audit::Threshold;
use unlift::neighbors::oracle::Noise;
use unlift::obfuscate::{Entry, Mitigation, Protection};
use unlift::recover::Builtin;

use unlift_report::compare::Accepted;
use unlift_vision::network::DescriptorKind;

use super::audits::{ExtractionArgs, MapArgs};
use crate::values::{self, NeighborSource};

#[derive(Debug, Args)]
#[command(after_help = include_str!("help/demo.txt").trim_end())]
pub struct DemoArgs {
    /// Folder for report.html, photos.html and their JSON files; other files in it stay
    #[arg(long, value_name = "DIR", default_value = "unlift-demo")]
    pub out: PathBuf,
    /// Show no progress on stderr
    #[arg(long)]
    pub quiet: bool,
}

#[derive(Debug, Args)]
#[command(after_help = include_str!("help/obfuscate.txt").trim_end())]
pub struct ObfuscateArgs {
    /// A map, any PATH of unlift audit map. Or images: a folder of photos, hloc's features.h5, or a COLMAP database.db
    pub path: PathBuf,
    /// Scheme that hides the points (unlift schemes lists them). Schemes for images need images
    #[arg(long = "schemes", alias = "scheme", value_name = "SCHEME", value_parser = values::by(unlift::obfuscate::scheme))]
    pub scheme: &'static Entry,
    /// Folder for released.npz and truth.npz; other files in it stay
    #[arg(long, value_name = "DIR", default_value = "unlift-obfuscated")]
    pub out: PathBuf,
    #[command(flatten)]
    pub map: MapArgs,
    /// Change the map before the scheme hides it, as unlift audit map --mitigate does
    #[arg(long, value_name = "STEPS", value_parser = values::by(Mitigation::parse), conflicts_with = "protect_descriptors")]
    pub mitigate: Option<Mitigation>,
    /// Release protected descriptors, as unlift audit map --protect-descriptors audits them
    #[arg(long, value_name = "RULE", value_parser = values::by(Protection::parse))]
    pub protect_descriptors: Option<Protection>,
    /// The descriptors that owner and users know, as for unlift audit map [default: the two photos of unlift demo]
    #[arg(long, value_name = "PATH", requires = "protect_descriptors")]
    pub public_descriptors: Option<PathBuf>,
    /// The audit.json of unlift audit map on this map: print what its attacks recover under this
    /// scheme, and refuse an audit of another map, or without this scheme
    #[arg(long, value_name = "FILE")]
    pub audit: Option<PathBuf>,
    /// Random seed, for experiments [default: a fresh 256-bit key]
    #[arg(long, value_name = "INTEGER")]
    pub seed: Option<u64>,
}

#[derive(Debug, Args)]
#[command(after_help = include_str!("help/neighbors.txt").trim_end())]
pub struct NeighborsArgs {
    /// The released.npz of a map or of images
    pub released: PathBuf,
    /// Method that makes the lists, see Sources below
    #[arg(long, value_name = "SOURCE", value_parser = values::any_source)]
    pub neighbors: NeighborSource,
    /// For the oracle: the truth.npz that belongs to RELEASED
    #[arg(long, value_name = "TRUTH", requires = "inlier_ratio")]
    pub truth: Option<PathBuf>,
    /// For the oracle: fraction of each list that consists of true nearest neighbors, from 0 to 1: round(RATIO x K) of K entries
    #[arg(long = "inlier-ratios", alias = "inlier-ratio", value_name = "RATIO", value_parser = values::ratio, requires = "truth")]
    pub inlier_ratio: Option<f64>,
    /// For the oracle: wrong entries of the lists, uniform, near or clustered (see unlift audit map)
    #[arg(long, value_name = "MODEL", value_parser = values::by(Noise::from_name), default_value = "uniform")]
    pub oracle_noise: Noise,
    /// Number of records per list; there is a list per hidden point [default: 50 for the oracle, otherwise chosen by the source]
    #[arg(long, value_name = "K", value_parser = value_parser!(u16).range(1..))]
    pub k: Option<u16>,
    /// Random seed
    #[arg(long, value_name = "INTEGER", default_value_t = 0)]
    pub seed: u64,
    /// File to write
    #[arg(long, value_name = "FILE", default_value = "neighborhoods.npz")]
    pub out: PathBuf,
}

#[derive(Debug, Args)]
#[command(after_help = include_str!("help/recover.txt").trim_end())]
pub struct RecoverArgs {
    /// The released.npz of a map or of images
    pub released: PathBuf,
    /// File with lists of neighbors, written by unlift neighbors or your own program
    /// (docs/formats.md). density and tomography compute positions without the lists and need them
    /// only to tell apart the two points of a line
    #[arg(long, value_name = "FILE")]
    pub neighbors: PathBuf,
    /// Recovery method: joint, consensus, ransac, density or tomography (see unlift audit map)
    #[arg(long, value_name = "SOLVER", value_parser = values::solver, default_value = "joint")]
    pub solver: Builtin,
    /// Random seed
    #[arg(long, value_name = "INTEGER", default_value_t = 0)]
    pub seed: u64,
    /// File to write
    #[arg(long, value_name = "FILE", default_value = "recovered.npz")]
    pub out: PathBuf,
}

#[derive(Debug, Args)]
#[command(after_help = include_str!("help/evaluate.txt").trim_end())]
pub struct EvaluateArgs {
    /// Recovered points that unlift recover wrote
    pub recovered: PathBuf,
    /// The truth.npz that unlift obfuscate wrote
    #[arg(long, value_name = "TRUTH")]
    pub truth: PathBuf,
    /// Largest errors at which a point counts as recovered, separated by commas [default: 0.10,0.25
    /// in meters, 1,5,10,25 in pixels, 1.0,2.5 in other units]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = values::threshold)]
    pub thresholds: Vec<Threshold>,
    /// Print the results as JSON, with the fields of a row of audit.json
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
#[command(after_help = include_str!("help/export.txt").trim_end())]
pub struct ExportArgs {
    /// A released, recovered or truth file of a map
    #[arg(value_name = "FILE")]
    pub path: PathBuf,
    /// File or folder to write; its ending decides the format, see below
    #[arg(long, value_name = "PATH")]
    pub out: PathBuf,
    /// Meters per unit of the map, as given to unlift obfuscate. The output then has the
    /// coordinates of the map [default: coordinates as in FILE]
    #[arg(long, value_name = "METERS_PER_UNIT", value_parser = values::scale)]
    pub scale: Option<f64>,
    /// A COLMAP model or project of the same map. Its cameras and images are copied to the exported model
    #[arg(long, value_name = "PROJECT")]
    pub cameras: Option<PathBuf>,
}

#[derive(Debug, Args)]
#[command(after_help = include_str!("help/features.txt").trim_end())]
pub struct FeaturesArgs {
    /// A folder of photos, hloc's features.h5, or a COLMAP database.db
    pub images: PathBuf,
    /// HDF5 file to write, in hloc's layout
    #[arg(long, value_name = "FILE", default_value = "features.h5")]
    pub out: PathBuf,
    #[command(flatten)]
    pub extraction: ExtractionArgs,
    /// Leave photos as they are stored, as COLMAP and hloc do. Without this option, photos are turned upright by their EXIF orientation
    #[arg(long)]
    pub as_stored: bool,
    /// Shrink photos whose longer side exceeds PIXELS; keypoints stay in pixels of the original photo [default: sift 3200, others 1600]
    #[arg(long, value_name = "PIXELS", value_parser = value_parser!(u32).range(16..=65536))]
    pub max_image_size: Option<u32>,
    /// Show no progress on stderr
    #[arg(long)]
    pub quiet: bool,
}

#[derive(Debug, Args)]
#[command(after_help = include_str!("help/invert.txt").trim_end())]
pub struct InvertArgs {
    /// A folder of photos, hloc's features.h5, a COLMAP database.db, or the released.npz of a map or of images
    pub path: PathBuf,
    /// Output file of unlift recover for PATH; required if PATH is a released.npz. Without it,
    /// unlift paints six views from the center of a sphere cloud
    pub recovered: Option<PathBuf>,
    /// Features to extract from photos: sift, aliked, or superpoint, whose weights you supply (see unlift models) [default: sift]
    #[arg(long, value_name = "TYPE", value_parser = values::by(DescriptorKind::from_name))]
    pub features: Option<DescriptorKind>,
    /// COLMAP model with the cameras from which to paint the map; only if PATH is a released map
    #[arg(long, value_name = "MODEL", requires = "recovered", requires = "scale")]
    pub cameras: Option<PathBuf>,
    /// The --scale given to unlift obfuscate: units of the released map per unit of MODEL
    #[arg(long, value_name = "SCALE", value_parser = values::positive, requires = "cameras")]
    pub scale: Option<f64>,
    /// Paint at most N images: evenly spaced by name or, if PATH is a released.npz of images, the first N
    #[arg(long, value_parser = values::count, value_name = "N")]
    pub max_images: Option<NonZeroUsize>,
    /// Folder for the pictures
    #[arg(long, value_name = "DIR", default_value = "unlift-pictures")]
    pub out: PathBuf,
}

#[derive(Debug, Args)]
#[command(after_help = include_str!("help/table.txt").trim_end())]
pub struct TableArgs {
    /// The audit.json of an audit
    #[arg(value_name = "AUDIT.json")]
    pub audit: PathBuf,
    /// Show only this threshold (the error up to which a point counts as recovered), one of the
    /// audit's --thresholds. By default, tables show all thresholds
    #[arg(long, value_name = "T", value_parser = values::threshold)]
    pub thresholds: Option<Threshold>,
    /// Write to this file in place of stdout; its ending decides the format, see below
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}

#[derive(Debug, Args)]
#[command(after_help = include_str!("help/compare.txt").trim_end())]
pub struct CompareArgs {
    /// The audit.json of the earlier audit
    #[arg(value_name = "OLD.json")]
    pub old: PathBuf,
    /// The audit.json of the later audit
    #[arg(value_name = "NEW.json")]
    pub new: PathBuf,
    /// Also write a page, compare.html, to this folder; other files in it stay
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Compare although points, scale, size or files differ, until this day (UTC). Text, JSON and page
    /// state the reason. A result that is larger still fails
    #[arg(long, value_name = "REASON, until YYYY-MM-DD", value_parser = values::accepted)]
    pub accept: Option<Accepted>,
    /// Print the comparison as JSON in place of the text
    #[arg(long)]
    pub json: bool,
}
