//! Learned networks: the list of models, their files, and how to run them.
//!
//! ```text
//! name ──> registry ──> folders, or what the program carries ──> hash, ports ──> Network ──> run
//! ```
//!
//! A *model* is a file in ONNX, a *network* is a loaded model. [`MODELS`] lists all models: some
//! are embedded in the program, others are supplied by the user. Inputs and outputs are
//! [`Tensor`]s, which the users of a network make and read.
//!
//! ```
//! use unlift_vision::network::{Network, Tensor};
//!
//! let network = Network::load("aliked-n16rot")?;
//! let image = Tensor::try_new(&[1, 3, 32, 32], vec![0.5; 3 * 32 * 32])?;
//! let [score] = network.run(vec![("image", image)], ["score"])?;
//! assert_eq!(score.shape(), [1, 1, 32, 32]);
//! # Ok::<(), unlift::Error>(())
//! ```

mod learned;
mod registry;

use std::borrow::Cow;
use std::fmt;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;

use rten::{Dimension, ModelOptions, NodeId, RunOptions, ThreadPool, Value};
use rten_tensor::prelude::*;
use sha2::{Digest, Sha256};
use unlift::Error;
use unlift::guard::{caught, told};

use crate::read_regular;

pub use learned::{Learned, SOURCES};
pub use registry::{Entry, Folders, MODELS, Port, entry};
pub use unlift::neighbors::DescriptorKind;

/// An array of floats, row-major.
#[derive(Clone, Debug, PartialEq)]
pub struct Tensor {
    shape: Vec<usize>,
    values: Vec<f32>,
}

impl Tensor {
    /// Creates an array with this shape.
    pub fn try_new(shape: &[usize], values: Vec<f32>) -> Result<Self, Error> {
        let n = shape.iter().try_fold(1_usize, |product, &side| product.checked_mul(side));
        if n != Some(values.len()) {
            let expected = format!("values of the shape {shape:?}");
            return Err(Error::new("tensor", expected, format!("{} values", values.len())));
        }
        Ok(Self { shape: shape.to_vec(), values })
    }

    /// Returns the lengths of the sides, outermost first.
    pub fn shape(&self) -> &[usize] {
        &self.shape
    }

    /// Returns all values, row-major.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// Returns all values and consumes the tensor.
    pub fn into_values(self) -> Vec<f32> {
        self.values
    }
}

/// A loaded model. Threads can share it and call [`run`](Self::run) at the same time.
pub struct Network {
    /// Name in errors: a path, or the name of an embedded model.
    place: String,
    sha256: String,
    // Boxed, because it has half a kilobyte and networks are fields of small enums.
    model: Box<rten::Model>,
    /// The model's outputs and their shapes.
    outputs: &'static [Port],
    /// Idle pools of one thread each, one per concurrent call.
    idle: Mutex<Vec<Arc<ThreadPool>>>,
}

impl fmt::Debug for Network {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Network")
            .field("place", &self.place)
            .field("sha256", &self.sha256)
            .finish_non_exhaustive()
    }
}

impl Network {
    /// Loads the model `name` of [`MODELS`] from the [`Folders::of_process`].
    ///
    /// # Errors
    /// If there is no such model, its hash differs, it is not ONNX, or has other inputs or outputs.
    pub fn load(name: &str) -> Result<Self, Error> {
        Self::load_from(&Folders::of_process(), entry(name)?)
    }

    /// Loads the model of `entry` from given folders.
    pub fn load_from(folders: &Folders, entry: &Entry) -> Result<Self, Error> {
        match (folders.find(entry)?, entry.carried) {
            (Some(path), _) => Self::read(&path, entry),
            (None, Some(bytes)) => Self::from_bytes(Cow::Borrowed(bytes), entry.name, entry),
            (None, None) => Err(folders.missing(entry)),
        }
    }

    /// Loads the model in the file `path`, as `entry` describes it.
    pub fn read(path: &Path, entry: &Entry) -> Result<Self, Error> {
        let place = path.display().to_string();
        let wrong = |error| Error::new(&*place, "a model in ONNX", error);
        Self::from_bytes(Cow::Owned(read_regular(path).map_err(wrong)?), &place, entry)
    }

    fn from_bytes(bytes: Cow<'static, [u8]>, place: &str, entry: &Entry) -> Result<Self, Error> {
        let sha256: String = Sha256::digest(&bytes).iter().map(|b| format!("{b:02x}")).collect();
        if let Some(expected) = entry.sha256
            && sha256 != expected
        {
            return Err(Error::new(place, format!("SHA-256 {expected}"), sha256));
        }
        let model = aside(|| {
            let mut options = ModelOptions::with_all_ops();
            // Uses twice the memory of the weights, but a tenth of the time.
            options.prepack_weights(true);
            match bytes {
                Cow::Borrowed(bytes) => options.load_static_slice(bytes),
                Cow::Owned(bytes) => options.load(bytes),
            }
        });
        let model = model.and_then(|model| model.map_err(|error| error.to_string()));
        let refused = |found: String| Error::new(place, "a model in ONNX", one_line(&found));
        let model = model.map_err(refused)?;
        let network = Self {
            place: place.to_owned(),
            sha256,
            model: Box::new(model),
            outputs: entry.outputs,
            idle: Mutex::new(Vec::new()),
        };
        network.check(entry.inputs, network.model.input_ids(), "input")?;
        network.check(entry.outputs, network.model.output_ids(), "output")?;
        Ok(network)
    }

    /// Returns the SHA-256 of the file, in hexadecimal.
    pub fn sha256(&self) -> &str {
        &self.sha256
    }

    /// Runs the part of the network from `inputs` to `outputs`, given by name, on one thread.
    ///
    /// Callers process several pictures or maps in parallel. Results may differ in the last bits
    /// between machines with other vector instructions.
    ///
    /// # Errors
    /// If a name is unknown, a shape does not fit, or an output is not an array of floats.
    pub fn run<const N: usize>(
        &self,
        inputs: Vec<(&str, Tensor)>,
        outputs: [&str; N],
    ) -> Result<[Tensor; N], Error> {
        let wrong =
            |expected: &str, found: &str| Error::new(&*self.place, expected, one_line(found));
        let id = |name: &str| {
            self.model.find_node(name).ok_or_else(|| wrong("a value of the network", name))
        };
        let mut values = Vec::with_capacity(inputs.len());
        for (name, tensor) in inputs {
            let value = Value::from_shape(&tensor.shape, tensor.values)
                .map_err(|error| wrong("a tensor", &error.to_string()))?;
            values.push((id(name)?, value.into()));
        }
        let requested = outputs.iter().map(|name| id(name)).collect::<Result<Vec<_>, _>>()?;
        let pool = self.idle().pop().unwrap_or_else(|| Arc::new(ThreadPool::with_num_threads(1)));
        let options = RunOptions::default().with_thread_pool(Some(Arc::clone(&pool)));
        let result = aside(|| self.model.run(values, &requested, Some(options)));
        let result = result.map_err(|panic| wrong("a network that runs", &panic))?;
        self.idle().push(pool);
        let values = result.map_err(|error| wrong("inputs that fit", &error.to_string()))?;
        let tensors = values.into_iter().zip(outputs).map(|(value, name)| {
            let Value::FloatTensor(tensor) = value else { return Err(wrong("floats", name)) };
            let shape = tensor.shape().to_vec();
            // The declared shapes of a file may be wrong.
            let port = self.outputs.iter().find(|port| port.name == name);
            if let Some(port) = port.filter(|port| !port.takes(&shape)) {
                return Err(wrong(&format!("an output {port}"), &format!("{shape:?}")));
            }
            Tensor::try_new(&shape, tensor.into_data())
        });
        let tensors = tensors.collect::<Result<Vec<_>, _>>()?;
        let n = tensors.len().to_string();
        tensors.try_into().map_err(|_| wrong(&format!("{N} outputs"), &n))
    }

    fn idle(&self) -> MutexGuard<'_, Vec<Arc<ThreadPool>>> {
        // The list stays valid if another thread panics.
        self.idle.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Checks that the file has these inputs or outputs, with these shapes.
    fn check(&self, ports: &[Port], ids: &[NodeId], kind: &str) -> Result<(), Error> {
        for port in ports {
            let infos = || ids.iter().filter_map(|&id| self.model.node_info(id));
            let wrong = |found: String| {
                Error::new(&*self.place, format!("an {kind} {port}"), one_line(&found))
            };
            let Some(info) = infos().find(|info| info.name() == Some(port.name)) else {
                let names: Vec<String> =
                    infos().filter_map(|info| info.name().map(str::to_owned)).collect();
                return Err(wrong(format!("{kind}s {}", names.join(", "))));
            };
            // Exporters may omit shapes of outputs; `run` checks the actual ones.
            let Some(shape) = info.shape() else { continue };
            let fits = shape.len() == port.shape.len()
                && shape.iter().zip(port.shape).all(|(side, expected)| match (side, expected) {
                    (Dimension::Fixed(side), Some(expected)) => side == expected,
                    (Dimension::Fixed(_), None) => false,
                    (Dimension::Symbolic(_), expected) => kind == "output" || expected.is_none(),
                });
            if !fits {
                return Err(wrong(format!("{shape:?}")));
            }
        }
        Ok(())
    }
}

/// Runs `work`, which waits for a pool of rten, on its own thread. A waiting rayon thread would
/// start other work in the meantime: more pictures in memory, or work that needs the network that
/// is being loaded. A panic of rten becomes an error with its message.
fn aside<T: Send>(work: impl FnOnce() -> T + Send) -> Result<T, String> {
    thread::scope(|scope| {
        let done = scope.spawn(|| caught(work)).join();
        done.unwrap_or_else(|panic| Err(told(&*panic)))
    })
    .map_err(|panic| format!("one that fails ({panic})"))
}

/// Joins the lines of a text of other libraries.
fn one_line(text: &str) -> String {
    text.lines().map(str::trim).collect::<Vec<_>>().join(" ")
}
