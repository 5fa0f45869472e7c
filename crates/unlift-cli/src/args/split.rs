//! Arguments of `unlift split`.

use std::path::PathBuf;

use clap::{Args, value_parser};

/// Options of `split`.
#[derive(Debug, Args)]
#[command(after_help = "\
Parts are part-000000.parquet and following, in the order of the rows; _manifest.json says how many
rows and bytes each has, and what all of them are about. Every command that reads FILE reads the
folder as it does FILE, and so does any engine that reads Parquet. A folder that an engine wrote is
read too, with or without a manifest.

Examples:
  unlift split hidden/released.parquet --out hidden/released
  unlift split lists --rows 100000 --out lists-in-parts")]
pub struct SplitArgs {
    /// A stage file, or a folder of its parts
    #[arg(value_name = "FILE")]
    pub path: PathBuf,
    /// Rows of a part; an odd number is rounded up
    #[arg(long, value_name = "N", default_value_t = 1 << 20, value_parser = value_parser!(u64).range(1..=u64::from(u32::MAX)))]
    pub rows: u64,
    /// The folder for the parts
    #[arg(long, value_name = "FOLDER")]
    pub out: PathBuf,
    /// Replace files of those names that unlift did not write
    #[arg(long)]
    pub force: bool,
}
