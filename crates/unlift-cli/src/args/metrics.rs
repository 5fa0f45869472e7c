//! Arguments of `unlift metrics`.

use std::path::PathBuf;

use clap::Args;

/// Options of `metrics`.
#[derive(Debug, Args)]
#[command(after_help = "\
SSIM as scikit-image has it by default (7 x 7 windows, mean of the colors), PSNR in dB, LPIPS 0.1 on
SqueezeNet. Of folders, pictures of the same name are compared, whatever their extension. A picture of
twice the other's size is halved first.

Examples:
  unlift metrics photo.jpg picture.png
  unlift metrics photos pictures --json")]
pub struct MetricsArgs {
    /// A picture, or a folder of pictures
    pub a: PathBuf,
    /// Another of the same size or half or twice that, or a folder of these
    pub b: PathBuf,
    /// Print an object with ssim, psnr and lpips in place of the text; of folders, such means and `pictures`
    #[arg(long)]
    pub json: bool,
}
