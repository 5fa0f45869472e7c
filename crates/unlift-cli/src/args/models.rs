//! Arguments of `unlift models`.

use clap::Args;

/// Options of `models`.
#[derive(Debug, Args)]
#[command(after_help = "\
A model is looked for in the folder that UNLIFT_MODELS names, then in unlift/models under
XDG_DATA_HOME (~/.local/share), then in the program itself. A file with another hash than the one
listed is refused.")]
pub struct ModelsArgs {
    /// Print a list of objects in place of the text
    #[arg(long)]
    pub json: bool,
}
