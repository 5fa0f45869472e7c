//! The registry of models, and where their files are: in the user's folders, or embedded.

use std::fmt;
use std::path::PathBuf;

use unlift::Error;

/// A model's description.
#[derive(Debug)]
pub struct Entry {
    /// Its name; the file is `NAME.onnx`.
    pub name: &'static str,
    /// Its purpose, in a line.
    pub purpose: &'static str,
    /// License of the weights, as an SPDX identifier if there is one.
    pub licence: &'static str,
    /// The page or file that publishes it.
    pub owner: &'static str,
    /// SHA-256 of the file, in hexadecimal; `None` if users make the file themselves.
    pub sha256: Option<&'static str>,
    /// The inputs, in the order of the file.
    pub inputs: &'static [Port],
    /// The outputs.
    pub outputs: &'static [Port],
    /// The file itself, if it is embedded in the program.
    pub carried: Option<&'static [u8]>,
}

/// An input or output of a network.
#[derive(Debug)]
pub struct Port {
    /// Its name in the file.
    pub name: &'static str,
    /// Lengths of its sides; `None` is any.
    pub shape: &'static [Option<usize>],
}

impl Port {
    pub(crate) fn takes(&self, shape: &[usize]) -> bool {
        let fits = |(side, expected): (&usize, &Option<usize>)| expected.is_none_or(|n| n == *side);
        shape.len() == self.shape.len() && shape.iter().zip(self.shape).all(fits)
    }
}

impl fmt::Display for Port {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let side = |side: &Option<usize>| side.map_or("any".to_owned(), |n| n.to_string());
        let sides: Vec<String> = self.shape.iter().map(side).collect();
        write!(f, "{} of shape ({})", self.name, sides.join(", "))
    }
}

impl Entry {
    /// Returns the file name: `aliked-n16rot.onnx`.
    pub fn file(&self) -> String {
        format!("{}.onnx", self.name)
    }
}

/// Returns the entry called `name`.
pub fn entry(name: &str) -> Result<&'static Entry, Error> {
    let known = || MODELS.iter().map(|entry| entry.name).collect::<Vec<_>>().join(", ");
    let entry = MODELS.iter().find(|entry| entry.name == name);
    entry.ok_or_else(|| Error::new("model", format!("one of {}", known()), name))
}

/// The output of networks that make pictures.
const PICTURE: &[Port] = &[Port { name: "picture", shape: &[Some(1), Some(3), None, None] }];
/// The output of networks that score pairs of descriptors.
const SCORES: &[Port] = &[Port { name: "scores", shape: &[None, None] }];

/// All models, by name. A `const` would copy all embedded files to each use.
pub static MODELS: &[Entry] = &[
    Entry {
        name: "aliked-n16rot",
        purpose: "keypoints and descriptors of photos (ALIKED)",
        licence: "BSD-3-Clause",
        owner: "https://github.com/Shiaoming/ALIKED",
        sha256: Some("94bcc6401df51e1368e44f997f16f17765fba2fbe8050ffc59f54f6876f58754"),
        inputs: &[
            Port { name: "image", shape: &[Some(1), Some(3), None, None] },
            Port { name: "patch", shape: &[None, Some(9), Some(128)] },
            Port { name: "samples", shape: &[None, Some(16), Some(128)] },
        ],
        outputs: &[
            Port { name: "score", shape: &[Some(1), Some(1), None, None] },
            Port { name: "level1", shape: &[Some(1), Some(32), None, None] },
            Port { name: "level2", shape: &[Some(1), None, None, Some(32)] },
            Port { name: "level3", shape: &[Some(1), None, None, Some(32)] },
            Port { name: "level4", shape: &[Some(1), None, None, Some(32)] },
            Port { name: "offsets", shape: &[None, Some(2), Some(16)] },
            Port { name: "descriptors", shape: &[None, Some(128)] },
        ],
        carried: Some(unlift_model_aliked_n16rot::ONNX),
    },
    Entry {
        name: "inverter-aliked",
        purpose: "pictures from keypoints or points of a map and their ALIKED descriptors",
        licence: "MIT OR Apache-2.0",
        owner: "https://github.com/unlift/unlift",
        sha256: Some("99a466241a5d569053bb514c0e35f348faed8867c65c7054aeb8422841aca69e"),
        inputs: &[Port { name: "features", shape: &[Some(1), Some(131), None, None] }],
        outputs: PICTURE,
        carried: Some(unlift_model_inverter_aliked::ONNX),
    },
    Entry {
        name: "inverter-sift",
        purpose: "pictures from keypoints or points of a map and their SIFT descriptors",
        licence: "MIT OR Apache-2.0",
        owner: "https://github.com/unlift/unlift",
        sha256: Some("da3df84cfde8f9ffd64347c5cd580eb565f194be3b68194400b64bc180811c63"),
        inputs: &[Port { name: "features", shape: &[Some(1), Some(135), None, None] }],
        outputs: PICTURE,
        carried: Some(unlift_model_inverter_sift::ONNX),
    },
    Entry {
        name: "inverter-superpoint",
        purpose: "pictures from keypoints or points of a map and their SuperPoint descriptors, trained by users who \
                  have SuperPoint: training/inversion",
        licence: "yours",
        owner: "training/inversion/README.md of https://github.com/unlift/unlift",
        // Users train it themselves.
        sha256: None,
        inputs: &[Port { name: "features", shape: &[Some(1), Some(259), None, None] }],
        outputs: PICTURE,
        carried: None,
    },
    Entry {
        name: "lpips-squeeze",
        purpose: "how far apart two pictures look (LPIPS 0.1, SqueezeNet)",
        licence: "BSD-2-Clause",
        owner: "https://github.com/richzhang/PerceptualSimilarity",
        sha256: Some("848fca4cbcbe77262fd39ae6ebcc16adab9261d03e558f0a5881b3dcaf5c261e"),
        inputs: &[
            Port { name: "a", shape: &[Some(1), Some(3), None, None] },
            Port { name: "b", shape: &[Some(1), Some(3), None, None] },
        ],
        outputs: &[Port { name: "distance", shape: &[Some(1)] }],
        carried: Some(unlift_model_lpips_squeeze::ONNX),
    },
    Entry {
        name: "neighbors-aliked",
        purpose: "near points by their ALIKED descriptors (the source `learned`)",
        licence: "MIT OR Apache-2.0",
        owner: "https://github.com/unlift/unlift",
        sha256: Some("a3b1aa593062bc02dcd0aebba45474d7063b8d8b81dd8f619b1978a58975cfe6"),
        inputs: &[
            Port { name: "descriptors", shape: &[None, Some(128)] },
            Port { name: "pairs", shape: &[Some(1), None, None] },
        ],
        outputs: SCORES,
        carried: Some(unlift_model_neighbors_aliked::ONNX),
    },
    Entry {
        name: "neighbors-sift",
        purpose: "near points by their SIFT descriptors (the source `learned`)",
        licence: "MIT OR Apache-2.0",
        owner: "https://github.com/unlift/unlift",
        sha256: Some("4bc72d9d8bb8e982305d5a6aa8ab469f16b309f1889d61384fe2dc90845a8380"),
        inputs: &[
            Port { name: "descriptors", shape: &[None, Some(128)] },
            Port { name: "pairs", shape: &[Some(3), None, None] },
        ],
        outputs: SCORES,
        carried: Some(unlift_model_neighbors_sift::ONNX),
    },
    Entry {
        name: "neighbors-superpoint",
        purpose: "near points by their SuperPoint descriptors (the source `learned`), trained by users who have SuperPoint: \
                  training/neighbors",
        licence: "yours",
        owner: "training/neighbors/README.md of https://github.com/unlift/unlift",
        // Users train it themselves.
        sha256: None,
        inputs: &[
            Port { name: "descriptors", shape: &[None, Some(256)] },
            Port { name: "pairs", shape: &[Some(1), None, None] },
        ],
        outputs: SCORES,
        carried: None,
    },
    Entry {
        name: "superpoint",
        purpose: "keypoints and descriptors of photos (SuperPoint), converted from the owner's superpoint_v1.pth by \
                  training/export/superpoint.py",
        licence: "non-commercial research only, no redistribution",
        owner: "https://github.com/magicleap/SuperPointPretrainedNetwork",
        // The bytes depend on the exporter's version; the script checks the published weights.
        sha256: None,
        inputs: &[Port { name: "image", shape: &[Some(1), Some(1), None, None] }],
        outputs: &[
            Port { name: "score", shape: &[Some(1), None, None] },
            Port { name: "coarse", shape: &[Some(1), None, None, Some(256)] },
        ],
        carried: None,
    },
    Entry {
        name: "yolox-nano",
        purpose: "everyday objects in pictures (YOLOX-nano, the classes of COCO)",
        licence: "Apache-2.0",
        owner: "https://github.com/Megvii-BaseDetection/YOLOX",
        sha256: Some("695e750a5d5754bb5a8d5325643b59282191a7e7a564e435a415fd3c578eab14"),
        inputs: &[Port { name: "images", shape: &[Some(1), Some(3), Some(416), Some(416)] }],
        outputs: &[Port { name: "output", shape: &[Some(1), Some(3549), Some(85)] }],
        carried: Some(unlift_model_yolox_nano::ONNX),
    },
];

/// The environment variable that names a folder of models.
const VARIABLE: &str = "UNLIFT_MODELS";

/// Folders that are searched for models before the embedded ones.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Folders {
    /// The folder in `UNLIFT_MODELS`.
    pub given: Option<PathBuf>,
    /// `unlift/models` in the user's data folder.
    pub user: Option<PathBuf>,
}

impl Folders {
    /// Returns the folders of this process: `UNLIFT_MODELS`, and `XDG_DATA_HOME/unlift/models`
    /// (default `~/.local/share`, on Windows `%APPDATA%`).
    pub fn of_process() -> Self {
        let set =
            |name| std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
        let home = || match cfg!(windows) {
            true => set("APPDATA"),
            false => set("HOME").map(|home| home.join(".local").join("share")),
        };
        let user = set("XDG_DATA_HOME").or_else(home);
        Self { given: set(VARIABLE), user: user.map(|data| data.join("unlift").join("models")) }
    }

    /// Finds the file of `entry` in the folders; it replaces the embedded one.
    ///
    /// # Errors
    /// If `UNLIFT_MODELS` is not a folder.
    pub fn find(&self, entry: &Entry) -> Result<Option<PathBuf>, Error> {
        if let Some(given) = &self.given
            && !given.is_dir()
        {
            return Err(Error::new(VARIABLE, "a folder", given.display()));
        }
        let folders = [&self.given, &self.user].into_iter().flatten();
        Ok(folders.map(|folder| folder.join(entry.file())).find(|path| path.is_file()))
    }

    /// Returns the error for a missing `entry`, which names the folders it belongs in.
    pub fn missing(&self, entry: &Entry) -> Error {
        let folders = [&self.given, &self.user].into_iter().flatten();
        let folders: Vec<String> = folders.map(|folder| folder.display().to_string()).collect();
        let place = match folders.as_slice() {
            [] => format!("the folder that {VARIABLE} names"),
            folders => folders.join(" or "),
        };
        Error::new(entry.file(), format!("in {place} ({})", entry.owner), "nothing")
    }
}
