//! Arguments of `unlift export`.

use std::path::PathBuf;

use clap::Args;

use crate::values;

/// Options of `export`.
#[derive(Debug, Args)]
#[command(after_help = "\
The ending of --out says what is written: .ply points, .obj released lines or rays as segments,
transforms.json cameras for nerfstudio, and sparse_pc.ply beside it, none a folder with a COLMAP
model in text (cameras.txt, images.txt, points3D.txt). Whatever shows points is as private as the
map.

Examples:
  unlift export back.parquet --scale 1 --out back.ply
  unlift export hidden/released.parquet --scale 1 --out lines.obj
  unlift export back.parquet --scale 1 --cameras PROJECT --out back-model
  unlift export back.parquet --scale 1 --cameras PROJECT --out back-nerf/transforms.json")]
pub struct ExportArgs {
    /// A released, recovered or truth file of a map
    #[arg(value_name = "FILE")]
    pub path: PathBuf,
    /// File or folder to write
    #[arg(long, value_name = "PATH")]
    pub out: PathBuf,
    /// Meters per unit of the map, as obfuscate was told: what is written lies on the map [default: lengths as in FILE]
    #[arg(long, value_name = "METERS", value_parser = values::scale)]
    pub scale: Option<f64>,
    /// A COLMAP model or project of the same map, whose cameras and images the model gets, or transforms.json
    #[arg(long, value_name = "PROJECT")]
    pub cameras: Option<PathBuf>,
    /// Replace files of that name that unlift did not write
    #[arg(long)]
    pub force: bool,
}
