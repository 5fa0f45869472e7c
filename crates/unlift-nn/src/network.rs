//! A network from a file of a model: checked, loaded, run.

use std::borrow::Cow;
use std::fmt;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;

use rten::{
    Dimension, ModelOptions, NodeId, OpRegistry, RunOptions, ThreadPool, Value, op_registry,
};
use rten_tensor::prelude::*;
use sha2::{Digest, Sha256};
use unlift::Error;
use unlift::guard::{caught, told};

use crate::folders::{Folders, Place};
use crate::registry::{Entry, Port, entry};
use crate::tensor::Tensor;
use crate::wire;

/// A model that is loaded. Shared by threads: [`run`](Self::run) may be called from many at once.
pub struct Network {
    /// How it is called in errors: a path, or the name of what the program carries.
    place: String,
    sha256: String,
    // Boxed: half a kilobyte, and networks stand in enums beside small things.
    model: Box<rten::Model>,
    /// What the model gives, of which shapes.
    outputs: &'static [Port],
    /// One per call that runs at the same time, each of one thread.
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
    /// The model `name` of [`MODELS`](crate::MODELS), from where [`Folders::of_process`] finds it.
    ///
    /// # Errors
    /// One line: no such name, missing, another file than the one that is known by its hash, no ONNX, or one with other
    /// inputs and outputs.
    pub fn load(name: &str) -> Result<Self, Error> {
        Self::load_from(&Folders::of_process(), entry(name)?)
    }

    /// The same from given folders.
    ///
    /// # Errors
    /// As [`load`](Self::load).
    pub fn load_from(folders: &Folders, entry: &Entry) -> Result<Self, Error> {
        match (folders.find(entry)?, entry.carried) {
            (Some(Place::File(path)), _) => Self::read(&path, entry),
            (Some(Place::Carried), Some(bytes)) => {
                let all = OpRegistry::with_all_ops;
                Self::from_bytes(Cow::Borrowed(bytes), (entry.name, entry), all)
            }
            _ => Err(folders.missing(entry)),
        }
    }

    /// The model in a file anywhere, as `entry` describes it.
    ///
    /// # Errors
    /// As [`load`](Self::load), and when the file cannot be read.
    pub fn read(path: &Path, entry: &Entry) -> Result<Self, Error> {
        Self::read_with(path, entry, OpRegistry::with_all_ops)
    }

    /// The model in a file of a stranger, as `entry` describes it: with plain operators alone, whose results are about as large as
    /// what they are made of or as the file, so that none makes anything huge or endless out of a few numbers.
    ///
    /// # Errors
    /// As [`read`](Self::read), and when it has other operators.
    pub fn read_plain(path: &Path, entry: &Entry) -> Result<Self, Error> {
        Self::read_with(path, entry, plain_operators)
    }

    fn read_with(path: &Path, entry: &Entry, operators: fn() -> OpRegistry) -> Result<Self, Error> {
        let place = path.display().to_string().escape_debug().to_string();
        let bytes = crate::file::bytes(path)
            .map_err(|error| Error::new(place.clone(), "a model in ONNX", error.to_string()))?;
        Self::from_bytes(Cow::Owned(bytes), (&place, entry), operators)
    }

    /// The model of these bytes, called `place` in errors.
    fn from_bytes(
        bytes: Cow<'static, [u8]>,
        (place, entry): (&str, &Entry),
        operators: fn() -> OpRegistry,
    ) -> Result<Self, Error> {
        let sha256: String = Sha256::digest(&bytes).iter().map(|b| format!("{b:02x}")).collect();
        if let Some(expected) = entry.sha256
            && sha256 != expected
        {
            return Err(Error::new(place, format!("SHA-256 {expected}"), sha256));
        }
        wire::check(&bytes).map_err(|found| Error::new(place, "a model in ONNX", found))?;
        let model = aside(|| {
            let mut options = ModelOptions::with_ops(operators());
            // Twice the memory of the weights, a tenth of the time.
            options.prepack_weights(true);
            match bytes {
                Cow::Borrowed(bytes) => options.load_static_slice(bytes),
                Cow::Owned(bytes) => options.load(bytes),
            }
        });
        let refused = |found: &str| Error::new(place, "a model in ONNX", one_line(found));
        let model = model.map_err(|panic| refused(&panic))?;
        let model = model.map_err(|error| refused(&error.to_string()))?;
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

    /// SHA-256 of the file, in hexadecimal.
    pub fn sha256(&self) -> &str {
        &self.sha256
    }

    /// Runs the parts of the network that lead from `inputs` to `outputs`, by their names, on one thread.
    ///
    /// One thread, as there are many pictures or maps to do at once: whoever calls this does so from as many threads
    /// as there are, and the numbers do not depend on how many that is. They may differ in the last bits between
    /// machines with other vector instructions.
    ///
    /// # Errors
    /// When a name is not one of the network's, a shape is not what it takes, or an output is no array of floats.
    pub fn run<const N: usize>(
        &self,
        inputs: Vec<(&str, Tensor)>,
        outputs: [&str; N],
    ) -> Result<[Tensor; N], Error> {
        let found = self.run_all(inputs, &outputs)?;
        let fewer = |found: Vec<Tensor>| {
            Error::new(&*self.place, format!("{N} outputs"), found.len().to_string())
        };
        found.try_into().map_err(fewer)
    }

    /// The same with any number of outputs.
    ///
    /// # Errors
    /// As [`run`](Self::run).
    pub fn run_all(
        &self,
        inputs: Vec<(&str, Tensor)>,
        outputs: &[&str],
    ) -> Result<Vec<Tensor>, Error> {
        let wrong =
            |expected: &str, found: &str| Error::new(&*self.place, expected, one_line(found));
        let id = |name: &str| {
            self.model.find_node(name).ok_or_else(|| wrong("a value of the network", name))
        };
        let mut given = Vec::with_capacity(inputs.len());
        for (name, tensor) in inputs {
            let shape = tensor.shape().to_vec();
            let value = Value::from_shape(&shape, tensor.into_values())
                .map_err(|error| wrong("a tensor", &error.to_string()))?;
            given.push((id(name)?, value.into()));
        }
        let asked = outputs.iter().map(|name| id(name)).collect::<Result<Vec<_>, _>>()?;
        let pool = self.idle().pop().unwrap_or_else(|| Arc::new(ThreadPool::with_num_threads(1)));
        let options = RunOptions::default().with_thread_pool(Some(Arc::clone(&pool)));
        let result = aside(|| self.model.run(given, &asked, Some(options)));
        let result = result.map_err(|panic| wrong("a network that runs", &panic))?;
        self.idle().push(pool);
        let values = result.map_err(|error| wrong("inputs that fit", &error.to_string()))?;
        let tensors = values.into_iter().zip(outputs).map(|(value, name)| match value {
            Value::FloatTensor(tensor) => {
                let shape = tensor.shape().to_vec();
                // What a file says of its outputs need not be so.
                let port = self.outputs.iter().find(|port| port.name == *name);
                if let Some(port) = port.filter(|port| !port.takes(&shape)) {
                    return Err(wrong(&format!("an output {port}"), &format!("{shape:?}")));
                }
                Tensor::try_new(&shape, tensor.into_data())
            }
            _ => Err(wrong("floats", name)),
        });
        tensors.collect()
    }

    fn idle(&self) -> MutexGuard<'_, Vec<Arc<ThreadPool>>> {
        // A list of idle pools is whole whatever happened to who held it.
        self.idle.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether the file has these inputs or outputs, of these shapes.
    fn check(&self, ports: &[Port], ids: &[NodeId], kind: &str) -> Result<(), Error> {
        for port in ports {
            let info = ids.iter().filter_map(|&id| self.model.node_info(id));
            let found = info.into_iter().find(|info| info.name() == Some(port.name));
            let expected = || format!("an {kind} {port}");
            let wrong = |found: String| Error::new(&*self.place, expected(), found);
            let Some(found) = found else {
                let names = ids.iter().filter_map(|&id| self.model.node_info(id)?.name());
                let names: Vec<&str> = names.collect();
                return Err(wrong(format!("{kind}s {}", one_line(&names.join(", ")))));
            };
            // Exporters may leave shapes of outputs out; `run` gives the true one.
            let Some(shape) = found.shape() else { continue };
            let fits = shape.len() == port.shape.len()
                && shape.iter().zip(port.shape).all(|(side, expected)| match (side, expected) {
                    (Dimension::Fixed(side), Some(expected)) => side == expected,
                    (Dimension::Fixed(_), None) => false,
                    (Dimension::Symbolic(_), expected) => kind == "output" || expected.is_none(),
                });
            if !fits {
                return Err(wrong(one_line(&format!("{shape:?}"))));
            }
        }
        Ok(())
    }
}

/// Operators of networks that nobody has looked at: no loops, and none that fills a shape that it is told.
fn plain_operators() -> OpRegistry {
    op_registry!(
        Abs,
        Add,
        AveragePool,
        BatchNormalization,
        Cast,
        Clip,
        Concat,
        Conv,
        ConvTranspose,
        DepthToSpace,
        Div,
        Elu,
        Equal,
        Erf,
        Exp,
        Flatten,
        Gather,
        Gelu,
        Gemm,
        GlobalAveragePool,
        Greater,
        HardSigmoid,
        HardSwish,
        Identity,
        InstanceNormalization,
        LayerNormalization,
        LeakyRelu,
        Less,
        Log,
        MatMul,
        Max,
        MaxPool,
        Min,
        Mul,
        Neg,
        Pad,
        Pow,
        PRelu,
        ReduceL2,
        ReduceMax,
        ReduceMean,
        ReduceSum,
        Relu,
        Reshape,
        Resize,
        Shape,
        Sigmoid,
        Slice,
        Softmax,
        Softplus,
        Split,
        Sqrt,
        Squeeze,
        Sub,
        Tanh,
        Transpose,
        Unsqueeze,
        Where
    )
}

/// Does `work`, which waits for a pool of rten, on a thread of its own. A thread of rayon that waits for another pool
/// takes up other work in the meantime: one more picture, with all its maps in memory, and one more above it; or work
/// that needs the very network that it is loading. What rten panics at is an error like another: what the panic says.
fn aside<T: Send>(work: impl FnOnce() -> T + Send) -> Result<T, String> {
    thread::scope(|scope| {
        let done = scope.spawn(|| caught(work)).join();
        done.unwrap_or_else(|panic| Err(told(&*panic)))
    })
    .map_err(|panic| format!("one that fails ({panic})"))
}

/// What others say, in one line that holds nothing odd.
fn one_line(text: &str) -> String {
    text.lines().map(str::trim).collect::<Vec<_>>().join(" ").escape_debug().to_string()
}
