//! Arguments of `unlift doctor`.

use clap::Args;

/// Options of `doctor`.
#[derive(Debug, Args)]
#[command(after_help = "\
To be pasted into a report of a defect: names no folder and no file, and sends nothing.")]
pub struct DoctorArgs {
    /// Print an object in place of the text
    #[arg(long)]
    pub json: bool,
}
