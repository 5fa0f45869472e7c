//! Learned networks: the list of models, their files, and how to run them.
//!
//! ```text
//! name ──> registry ──> folders, or what the program carries ──> hash, ports ──> Network ──> run
//! ```
//!
//! A *model* is a file in ONNX, a *network* is a loaded model. [`MODELS`] lists all models: some
//! are embedded in the program, others are supplied by the user. Inputs and outputs are
//! [`Tensor`]s, which the users of a network make and read: the source [`Learned`], and the
//! extractors of `unlift-features`.
//!
//! ```
//! use unlift_nn::{Network, Tensor};
//!
//! let network = Network::load("aliked-n16rot")?;
//! let image = Tensor::try_new(&[1, 3, 32, 32], vec![0.5; 3 * 32 * 32])?;
//! let [score] = network.run(vec![("image", image)], ["score"])?;
//! assert_eq!(score.shape(), [1, 1, 32, 32]);
//! # Ok::<(), unlift::Error>(())
//! ```

pub mod file;
mod folders;
mod learned;
mod network;
mod registry;
mod tensor;
mod wire;

pub use folders::{Folders, Place, VARIABLE};
pub use learned::{Learned, SOURCES};
pub use network::Network;
pub use registry::{Entry, MODELS, Port, entry};
pub use tensor::Tensor;
pub use unlift::neighbors::DescriptorKind;
