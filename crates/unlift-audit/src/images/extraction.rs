//! Options of the feature extraction, as the command line names them.

use std::num::NonZeroUsize;
use std::path::Path;

use unlift::Descriptors;
use unlift::descriptors::Values;
use unlift::neighbors::DescriptorKind;
use unlift_vision::features::{Extraction, LearnedOptions, SiftOptions};

use crate::Error;

/// Returns two sample descriptors of a network, to check sources before the work; `None` for SIFT,
/// which every source accepts.
pub fn sample(extraction: &Extraction) -> Option<Descriptors> {
    if extraction.kind() == DescriptorKind::Sift {
        return None;
    }
    // The rows differ because equal rows are rejected.
    let dim = extraction.kind().dim();
    let rows = (0..2 * dim).map(|at| if at < dim { 0.1 } else { -0.1 }).collect();
    Descriptors::try_new(Values::F32(rows), dim).ok()
}

/// Options of the user; `None` is the default.
#[derive(Clone, Copy, Debug, Default)]
pub struct Wanted {
    /// The option that chooses the features.
    pub option: &'static str,
    /// The chosen features.
    pub kind: Option<DescriptorKind>,
    /// `--max-features`.
    pub max_features: Option<NonZeroUsize>,
    /// `--min-score`.
    pub min_score: Option<f32>,
    /// `--max-image-size`.
    pub max_image_size: Option<u32>,
}

impl Wanted {
    /// Returns the options of the extractor for the photos at `path`.
    ///
    /// # Errors
    /// If `path` is a file and an option is given, or an option belongs to other features.
    pub fn extraction(self, path: &Path) -> Result<Extraction, Error> {
        if path.is_file() {
            self.check_unused("a file")?;
        }
        Ok(match self.kind.unwrap_or(DescriptorKind::Sift) {
            DescriptorKind::Sift => {
                self.refuse("--min-score", self.min_score.is_some(), DescriptorKind::Aliked)?;
                let usual = SiftOptions::default();
                Extraction::Sift(SiftOptions {
                    max_features: self.max_features.map_or(usual.max_features, NonZeroUsize::get),
                    max_image_size: self
                        .max_image_size
                        .map_or(usual.max_image_size, |side| side as usize),
                })
            }
            DescriptorKind::Aliked => Extraction::Aliked(self.learned(LearnedOptions::ALIKED)),
            DescriptorKind::SuperPoint => {
                Extraction::SuperPoint(self.learned(LearnedOptions::SUPERPOINT))
            }
        })
    }

    fn learned(self, usual: LearnedOptions) -> LearnedOptions {
        LearnedOptions {
            max_features: self.max_features.map_or(usual.max_features, NonZeroUsize::get),
            min_score: self.min_score.unwrap_or(usual.min_score),
            max_image_size: self.max_image_size.map_or(usual.max_image_size, |side| side as usize),
        }
    }

    /// Rejects all options if features exist already, in `found`.
    pub fn check_unused(&self, found: &str) -> Result<(), Error> {
        let given = [
            (self.option, self.kind.is_some()),
            ("--max-features", self.max_features.is_some()),
            ("--min-score", self.min_score.is_some()),
            ("--max-image-size", self.max_image_size.is_some()),
        ];
        match given.iter().find(|(_, given)| *given) {
            Some((name, _)) => {
                let expected = "expected with a folder of photos";
                Err(Error::request(format!("{name}: {expected}, found {found}")))
            }
            None => Ok(()),
        }
    }

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
