//! What is extracted from photos: what users ask for as one value, by the names of the command line's options.

use std::num::NonZeroUsize;
use std::path::Path;

use unlift::Descriptors;
use unlift::descriptors::Values;
use unlift_features::{AlikedOptions, Extraction, SiftOptions, SuperPointOptions};
use unlift_nn::DescriptorKind;

use crate::Error;

/// Descriptors such as a network will make, to be shown to sources before the work; `None` of SIFT, which every source takes.
pub fn sample(extraction: &Extraction) -> Option<Descriptors> {
    if extraction.kind() == DescriptorKind::Sift {
        return None;
    }
    // Any two rows of floats that are not all alike.
    let dim = extraction.kind().dim();
    let rows = (0..2 * dim).map(|at| if at < dim { 0.1 } else { -0.1 }).collect();
    Descriptors::try_new(Values::F32(rows), dim).ok()
}

/// What was asked for; `None` is as usual.
#[derive(Clone, Copy, Debug, Default)]
pub struct Wanted {
    /// How the option is called that says which features.
    pub option: &'static str,
    /// Which features.
    pub kind: Option<DescriptorKind>,
    /// `--max-features`.
    pub max_features: Option<NonZeroUsize>,
    /// `--min-score`.
    pub min_score: Option<f32>,
    /// `--max-image-size`.
    pub max_image_size: Option<u32>,
    /// `--first-octave`.
    pub first_octave: Option<i8>,
}

impl Wanted {
    /// The same as options of the extractor, for what is at `path`: none of them fits a file.
    ///
    /// # Errors
    /// When one of them fits a file or other features only.
    pub fn extraction(self, path: &Path) -> Result<Extraction, Error> {
        if path.is_file() {
            self.check_unused("a file")?;
        }
        let max_features = self.max_features.map(NonZeroUsize::get);
        let max_image_size = self.max_image_size.map(|side| side as usize);
        Ok(match self.kind.unwrap_or(DescriptorKind::Sift) {
            DescriptorKind::Sift => {
                self.refuse("--min-score", self.min_score.is_some(), DescriptorKind::Aliked)?;
                let usual = SiftOptions::default();
                Extraction::Sift(SiftOptions {
                    max_features: max_features.unwrap_or(usual.max_features),
                    max_image_size: max_image_size.unwrap_or(usual.max_image_size),
                    doubled: self.first_octave.map_or(usual.doubled, |octave| octave < 0),
                    ..usual
                })
            }
            DescriptorKind::Aliked => {
                self.refuse("--first-octave", self.first_octave.is_some(), DescriptorKind::Sift)?;
                let usual = AlikedOptions::default();
                Extraction::Aliked(AlikedOptions {
                    max_features: max_features.unwrap_or(usual.max_features),
                    min_score: self.min_score.unwrap_or(usual.min_score),
                    max_image_size: max_image_size.unwrap_or(usual.max_image_size),
                })
            }
            DescriptorKind::SuperPoint => {
                self.refuse("--first-octave", self.first_octave.is_some(), DescriptorKind::Sift)?;
                let usual = SuperPointOptions::default();
                Extraction::SuperPoint(SuperPointOptions {
                    max_features: max_features.unwrap_or(usual.max_features),
                    min_score: self.min_score.unwrap_or(usual.min_score),
                    max_image_size: max_image_size.unwrap_or(usual.max_image_size),
                })
            }
        })
    }

    /// Refuses all of it where features are there already, in `found`.
    ///
    /// # Errors
    /// When anything was asked for.
    pub fn check_unused(&self, found: &str) -> Result<(), Error> {
        let given = [
            (self.option, self.kind.is_some()),
            ("--max-features", self.max_features.is_some()),
            ("--min-score", self.min_score.is_some()),
            ("--max-image-size", self.max_image_size.is_some()),
            ("--first-octave", self.first_octave.is_some()),
        ];
        match given.iter().find(|(_, given)| *given) {
            Some((name, _)) => {
                let expected = "expected with a folder of photos";
                Err(Error::request(format!("{name}: {expected}, found {found}")))
            }
            None => Ok(()),
        }
    }

    /// Refuses an option of other features.
    fn refuse(&self, name: &str, given: bool, fits: DescriptorKind) -> Result<(), Error> {
        if !given {
            return Ok(());
        }
        let option = self.option;
        let found = self.kind.map_or("none".to_owned(), |kind| format!("{option} {}", kind.name()));
        Err(Error::request(format!(
            "{name}: expected with {option} {}, found {found}",
            fits.name()
        )))
    }
}
