//! What is extracted from photos: options of `features` and `audit images` as one value.

use std::num::NonZeroUsize;
use std::path::Path;

use unlift_features::{AlikedOptions, Extraction, SiftOptions, SuperPointOptions};

use crate::exit::usage;
use crate::values::FeatureType;

/// What was typed.
#[derive(Default)]
pub struct Typed {
    /// How the option is called that says which features.
    pub option: &'static str,
    /// Which features.
    pub kind: Option<FeatureType>,
    /// `--max-features`.
    pub max_features: Option<NonZeroUsize>,
    /// `--min-score`.
    pub min_score: Option<f32>,
    /// `--max-image-size`.
    pub max_image_size: Option<u32>,
    /// `--first-octave`.
    pub first_octave: Option<i8>,
}

impl Typed {
    /// The same as options of the extractor, for what is at `path`: none of them fits a file.
    pub fn extraction(self, path: &Path) -> anyhow::Result<Extraction> {
        let given = [
            (self.option, self.kind.is_some()),
            ("--max-features", self.max_features.is_some()),
            ("--min-score", self.min_score.is_some()),
            ("--max-image-size", self.max_image_size.is_some()),
            ("--first-octave", self.first_octave.is_some()),
        ];
        if path.is_file()
            && let Some((name, _)) = given.iter().find(|(_, given)| *given)
        {
            return Err(usage(format!("{name}: expected with a folder of photos, found a file")));
        }
        let max_features = self.max_features.map(NonZeroUsize::get);
        let max_image_size = self.max_image_size.map(|side| side as usize);
        Ok(match self.kind.unwrap_or(FeatureType::Sift) {
            FeatureType::Sift => {
                self.refuse("--min-score", self.min_score.is_some(), FeatureType::Aliked)?;
                let usual = SiftOptions::default();
                Extraction::Sift(SiftOptions {
                    max_features: max_features.unwrap_or(usual.max_features),
                    max_image_size: max_image_size.unwrap_or(usual.max_image_size),
                    doubled: self.first_octave.map_or(usual.doubled, |octave| octave < 0),
                    ..usual
                })
            }
            FeatureType::Aliked => {
                self.refuse("--first-octave", self.first_octave.is_some(), FeatureType::Sift)?;
                let usual = AlikedOptions::default();
                Extraction::Aliked(AlikedOptions {
                    max_features: max_features.unwrap_or(usual.max_features),
                    min_score: self.min_score.unwrap_or(usual.min_score),
                    max_image_size: max_image_size.unwrap_or(usual.max_image_size),
                })
            }
            FeatureType::SuperPoint => {
                self.refuse("--first-octave", self.first_octave.is_some(), FeatureType::Sift)?;
                let usual = SuperPointOptions::default();
                Extraction::SuperPoint(SuperPointOptions {
                    max_features: max_features.unwrap_or(usual.max_features),
                    min_score: self.min_score.unwrap_or(usual.min_score),
                    max_image_size: max_image_size.unwrap_or(usual.max_image_size),
                })
            }
        })
    }

    /// Refuses an option of other features.
    fn refuse(&self, name: &str, given: bool, fits: FeatureType) -> anyhow::Result<()> {
        if !given {
            return Ok(());
        }
        let option = self.option;
        let found = self.kind.map_or("none".to_owned(), |kind| format!("{option} {}", kind.name()));
        Err(usage(format!("{name}: expected with {option} {}, found {found}", fits.name())))
    }
}
