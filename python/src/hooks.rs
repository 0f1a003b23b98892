//! Metrics and operations whose code is Python: each is an object of the user's class, created for each run, whose
//! methods are those of a hook in Rust.
//!
//! A hook that raises is the outcome of its test, as one in Rust that panics is. The context of a call is borrowed, so
//! Python's object for it finds it in a scoped variable of the thread.

use std::path::PathBuf;
use std::sync::OnceLock;

use pyo3::exceptions::{PyRuntimeError, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyFloat, PyInt, PyList, PyString, PyType};
use scoped_tls_hkt::scoped_thread_local;

use sesame_plan::{
    CampaignPlan, Choice, Domain, MetricSource, Moment, Operation, OperationKind, Parameter, Type, python,
};
use sesame_relay::fuzz::{self, MessageCall, OperationEntry, OperationHook};
use sesame_relay::metric::{Context, Hook, HookEntry};
use sesame_relay::value::Value;

use crate::raised;
use crate::types::{Types, Unfit};
use crate::value::Shapes;

/// What this process runs tests with.
static CODE: OnceLock<Code> = OnceLock::new();

#[derive(Debug)]
struct Code {
    plan: CampaignPlan,
    /// `sesamec._hooks`: how objects of the user's classes are created and their methods are named.
    package: Py<PyModule>,
    metrics: Py<PyDict>,
    operations: Py<PyDict>,
    types: Types,
}

/// The topics of a metric that is a hook.
pub(crate) fn inputs<'a>(plan: &'a CampaignPlan, source: &MetricSource) -> Option<Vec<&'a str>> {
    let MetricSource::Hook { topics } = source else { return None };
    Some(topics.iter().map(|&topic| plan.topic(topic).name.as_str()).collect())
}

/// The method of a hook that gets messages of a topic, for each topic.
pub(crate) fn methods(topics: &[&str]) -> Vec<String> {
    topics.iter().map(|topic| python::method(topic)).collect()
}

/// The method of a custom operation's hook.
pub(crate) fn method_of(plan: &CampaignPlan, operation: &Operation) -> Option<String> {
    let OperationKind::Custom { moment } = operation.kind else { return None };
    Some(match (moment, operation.topic) {
        (Moment::OnMessage, Some(topic)) => python::method(&plan.topic(topic).name),
        (Moment::AfterEnd, _) => "after_end".to_owned(),
        _ => "before_start".to_owned(),
    })
}

/// Takes the user's classes, and returns an entry for each that the plan uses. Entries live as long as the process, as
/// those of a compiled runner do.
pub(crate) fn register(
    py: Python<'_>,
    plan: CampaignPlan,
) -> PyResult<(&'static [HookEntry], &'static [OperationEntry])> {
    let package = py.import("sesamec._hooks")?;
    let registry = |name: &str| PyResult::Ok(package.getattr(name)?.cast_into::<PyDict>()?);
    let (metrics, operations) = (registry("METRICS")?, registry("OPERATIONS")?);
    let registered = |name: &str, classes: &Bound<'_, PyDict>| classes.contains(name);
    let (mut of_metrics, mut of_operations) = (Vec::new(), Vec::new());
    for metric in plan.metrics.iter().filter(|metric| matches!(metric.source, MetricSource::Hook { .. })) {
        if registered(&metric.name, &metrics)? {
            of_metrics.push(HookEntry { metric: metric.name.clone().leak(), build: metric_hook });
        }
    }
    for operation in plan.operations.iter().filter(|operation| matches!(operation.kind, OperationKind::Custom { .. })) {
        if registered(&operation.name, &operations)? {
            of_operations.push(OperationEntry { operation: operation.name.clone().leak(), build: operation_hook });
        }
    }
    let classes = package.getattr("of_space")?.call1((registry("MESSAGES")?, &plan.space))?.cast_into::<PyDict>()?;
    let types = Types::new(py, &plan, &classes)?;
    let package = package.unbind();
    let code = Code { plan, package, metrics: metrics.unbind(), operations: operations.unbind(), types };
    if CODE.set(code).is_err() {
        return Err(PyRuntimeError::new_err("this process has hooks already"));
    }
    Ok((of_metrics.leak(), of_operations.leak()))
}

fn code() -> &'static Code {
    CODE.get().expect("entries are made when it is set")
}

/// The result of the user's code. What it raises ends the run; a process that it forked ends here, or two processes
/// would serve one supervisor.
fn called<T>(returned: PyResult<T>) -> T {
    static OWN: OnceLock<u32> = OnceLock::new();
    if *OWN.get_or_init(std::process::id) != std::process::id() {
        std::process::exit(0);
    }
    returned.unwrap_or_else(|error| {
        let (message, traceback) = raised::told(&error);
        eprintln!("{traceback}");
        sesame_relay::panic_capture::raise(message)
    })
}

fn metric_hook(name: &str) -> Box<dyn Hook> {
    let code = code();
    let metric = code.plan.metrics.iter().find(|metric| metric.name == name).expect("it is of this plan");
    let MetricSource::Hook { topics } = &metric.source else { unreachable!("only hooks have entries") };
    let types = topics.iter().map(|&topic| &code.plan.topic(topic).ty).collect();
    let names = methods(&inputs(&code.plan, &metric.source).unwrap_or_default());
    let made = Python::attach(|py| {
        let class = code.metrics.bind(py).get_item(name)?.expect("it was registered");
        let methods = code.package.bind(py).getattr("metric_methods")?.call1((name, class, names))?;
        let (start, on, end) = methods.extract()?;
        PyResult::Ok(PythonMetric { start, on, end, types, context: Py::new(py, MetricContext)? })
    });
    Box::new(called(made))
}

struct PythonMetric {
    start: Option<Py<PyAny>>,
    /// For each input.
    on: Vec<Py<PyAny>>,
    /// Of its inputs.
    types: Vec<&'static Type>,
    end: Option<Py<PyAny>>,
    context: Py<MetricContext>,
}

scoped_thread_local!(static mut METRIC: Context);

impl Hook for PythonMetric {
    fn on_start(&mut self, ctx: &mut Context) {
        if let Some(start) = &self.start {
            called(METRIC.set(ctx, || Python::attach(|py| start.call1(py, (&self.context,)).map(drop))));
        }
    }

    fn on_message(&mut self, input: usize, value: &Value, ctx: &mut Context) {
        let (on, ty, code) = (&self.on[input], self.types[input], code());
        Python::attach(|py| {
            let returned = match code.types.object(py, &code.plan, ty, value) {
                Ok(message) => METRIC.set(ctx, || on.call1(py, (message, &self.context)).map(drop)),
                Err(Unfit::Mismatch(mismatch)) => return ctx.mismatch(&mismatch),
                Err(Unfit::Raised(error)) => Err(error),
            };
            called(returned);
        });
    }

    fn on_end(&mut self, ctx: &mut Context) {
        if let Some(end) = &self.end {
            called(METRIC.set(ctx, || Python::attach(|py| end.call1(py, (&self.context,)).map(drop))));
        }
    }
}

fn outside<T>() -> PyResult<T> {
    Err(PyRuntimeError::new_err("the context can be used only during the call that it was given to, in its thread"))
}

/// In which a metric's hook sets its value.
#[pyclass(frozen, module = "sesamec")]
pub(crate) struct MetricContext;

fn metric<T>(call: impl FnOnce(&mut Context) -> T) -> PyResult<T> {
    if METRIC.is_set() { Ok(METRIC.with(call)) } else { outside() }
}

#[pymethods]
impl MetricContext {
    /// Simulation time in seconds.
    #[getter]
    fn now(&self) -> PyResult<f64> {
        metric(|ctx| ctx.now())
    }

    /// Name on the wire of the message's topic; if the input is a group, of its member.
    #[getter]
    fn topic(&self) -> PyResult<String> {
        metric(|ctx| ctx.topic().to_owned())
    }

    /// The metric's value so far in this run.
    #[getter]
    fn value(&self) -> PyResult<Option<f64>> {
        metric(|ctx| ctx.value())
    }

    /// Sets the metric's value.
    fn set(&self, value: f64) -> PyResult<()> {
        metric(|ctx| ctx.set(value))
    }

    /// Adds to the metric's value, which starts at zero.
    #[pyo3(signature = (amount = 1.0))]
    fn add(&self, amount: f64) -> PyResult<()> {
        metric(|ctx| ctx.add(amount))
    }

    /// True the first time, and then whenever at least this many seconds of simulation time have passed since it was
    /// last true, for each key by itself.
    #[pyo3(signature = (period, key = ""))]
    fn every_seconds(&self, period: f64, key: &str) -> PyResult<bool> {
        metric(|ctx| ctx.every_seconds_for(key, period))
    }

    /// Marks this hook as not implemented yet.
    fn unimplemented(&self) -> PyResult<()> {
        metric(Context::unimplemented)
    }
}

fn operation_hook(name: &str, choices: &[Choice]) -> Box<dyn OperationHook> {
    let code = code();
    let operation = code.plan.operations.iter().find(|operation| operation.name == name).expect("it is of this plan");
    let OperationKind::Custom { moment } = operation.kind else { unreachable!("only custom operations have entries") };
    let topic = operation.topic.filter(|_| matches!(moment, Moment::OnMessage)).map(|topic| code.plan.topic(topic));
    let word = method_of(&code.plan, operation).expect("it is a custom operation");
    let made = Python::attach(|py| {
        let values = PyDict::new(py);
        for (parameter, choice) in operation.parameters.iter().zip(choices) {
            values.set_item(&*python::attribute(&parameter.name), chosen(py, parameter, choice)?)?;
        }
        let class = code.operations.bind(py).get_item(name)?.expect("it was registered");
        let package = code.package.bind(py);
        let method = package.getattr("operation_method")?.call1((name, class, &word))?.unbind();
        let parameters = package.getattr("parameters_of")?.call1((&code.plan.space, name, values))?.unbind();
        let context = Py::new(py, OperationContext)?;
        let around = Py::new(py, RunContext)?;
        let ty = topic.map(|topic| &topic.ty);
        PyResult::Ok(PythonOperation { method, word, parameters, context, around, ty, shapes: Shapes::default() })
    });
    Box::new(called(made))
}

fn chosen<'py>(py: Python<'py>, parameter: &Parameter, choice: &Choice) -> PyResult<Bound<'py, PyAny>> {
    Ok(match choice {
        #[expect(clippy::cast_possible_truncation, reason = "choices of whole numbers are at most 2^53")]
        Choice::Value { value } if matches!(parameter.domain, Domain::Number { integer: true, .. }) => {
            PyInt::new(py, *value as i64).into_any()
        }
        Choice::Value { value } => PyFloat::new(py, *value).into_any(),
        Choice::Text { text } => PyString::new(py, text).into_any(),
        Choice::Point { point } => PyList::new(py, point)?.into_any(),
        Choice::Range { .. } => unreachable!("parameters of custom operations have single values"),
    })
}

struct PythonOperation {
    method: Py<PyAny>,
    /// What the method is called.
    word: String,
    parameters: Py<PyAny>,
    context: Py<OperationContext>,
    around: Py<RunContext>,
    /// The type of the messages that it is called with.
    ty: Option<&'static Type>,
    shapes: Shapes,
}

/// What an operation can do besides changing its message.
trait Turn {
    fn now(&self) -> f64;
    fn topic(&self) -> String;
    fn draw(&mut self) -> f64;
    fn drop_message(&mut self);
    fn inject(&mut self, message: &Bound<'_, PyAny>) -> Result<(), Unfit>;
    fn unimplemented(&mut self);
}

/// One call of an operation's hook.
struct Called<'a, 'c> {
    ctx: &'a mut fuzz::OperationContext<'c, Value>,
    dropped: bool,
    /// The message as it came.
    original: &'a Value,
    ty: &'a Type,
    shapes: &'a mut Shapes,
}

impl Turn for Called<'_, '_> {
    fn now(&self) -> f64 {
        self.ctx.now()
    }

    fn topic(&self) -> String {
        self.ctx.topic().to_owned()
    }

    fn draw(&mut self) -> f64 {
        self.ctx.draw()
    }

    fn drop_message(&mut self) {
        self.dropped = true;
        self.ctx.drop_message();
    }

    fn inject(&mut self, message: &Bound<'_, PyAny>) -> Result<(), Unfit> {
        let code = code();
        // Undeclared parts are those of the original message.
        let mut injected = self.original.clone();
        code.types.write_back(&code.plan, self.shapes, self.ty, &mut injected, message)?;
        self.ctx.inject(injected);
        Ok(())
    }

    fn unimplemented(&mut self) {
        self.ctx.unimplemented();
    }
}

scoped_thread_local!(static mut OPERATION: for<'a> &'a mut (dyn Turn + 'a));
scoped_thread_local!(static mut RUN: for<'a> &'a mut (dyn Around + 'a));

/// What a hook can do before the start or after the end of a run.
trait Around {
    fn folder(&mut self) -> PathBuf;
    fn replace_file(&mut self, path: &str, contents: &[u8]);
    fn edit_file(&mut self, path: &str, edit: &mut dyn FnMut(&str) -> String);
    fn count_side_effect(&mut self);
    fn draw(&mut self) -> f64;
    fn unimplemented(&mut self);
}

impl Around for fuzz::RunContext<'_> {
    fn folder(&mut self) -> PathBuf {
        fuzz::RunContext::folder(self)
    }

    fn replace_file(&mut self, path: &str, contents: &[u8]) {
        fuzz::RunContext::replace_file(self, path, contents);
    }

    fn edit_file(&mut self, path: &str, edit: &mut dyn FnMut(&str) -> String) {
        fuzz::RunContext::edit_file(self, path, |text| edit(text));
    }

    fn count_side_effect(&mut self) {
        fuzz::RunContext::count_side_effect(self);
    }

    fn draw(&mut self) -> f64 {
        fuzz::RunContext::draw(self)
    }

    fn unimplemented(&mut self) {
        fuzz::RunContext::unimplemented(self);
    }
}

impl OperationHook for PythonOperation {
    fn on_message(&mut self, message: &mut Value, call: &mut MessageCall<'_>) {
        let PythonOperation { method, word, parameters, context, ty, shapes, .. } = self;
        let (ty, code) = (ty.expect("an operation on messages has a topic"), code());
        call.dynamic(message, |message, ctx| {
            Python::attach(|py| {
                let given = match code.types.object(py, &code.plan, ty, message) {
                    Ok(given) => given,
                    // It is passed on unchanged, with a warning of the run.
                    Err(Unfit::Mismatch(mismatch)) => return Err(mismatch),
                    Err(Unfit::Raised(error)) => called(Err(error)),
                };
                let original = message.clone();
                let mut turn = Called { ctx, dropped: false, original: &original, ty, shapes };
                let returned = OPERATION.set(&mut turn, || method.call1(py, (given, &*parameters, &*context)));
                let (returned, dropped) = (called(returned).into_bound(py), turn.dropped);
                if !(dropped && returned.is_none()) {
                    let read = code.types.write_back(&code.plan, shapes, ty, message, &returned);
                    called(read.map_err(|unfit| match unfit {
                        Unfit::Raised(error) => PyTypeError::new_err(format!(
                            "what `{word}` returned is not a message: {}",
                            error.value(py)
                        )),
                        Unfit::Mismatch(mismatch) => PyTypeError::new_err(format!(
                            "`{word}` has to return the message, also if it does not change it: {mismatch}"
                        )),
                    }));
                }
                Ok(())
            })
        });
    }

    fn before_or_after_run(&mut self, ctx: &mut fuzz::RunContext<'_>) {
        let (method, parameters, around) = (&self.method, &self.parameters, &self.around);
        called(RUN.set(ctx, || Python::attach(|py| method.call1(py, (parameters, around)).map(drop))));
    }
}

/// What an operation can do besides changing its message.
#[pyclass(frozen, module = "sesamec")]
pub(crate) struct OperationContext;

fn operation<T>(call: impl FnOnce(&mut dyn Turn) -> T) -> PyResult<T> {
    if OPERATION.is_set() { Ok(OPERATION.with(call)) } else { outside() }
}

#[pymethods]
impl OperationContext {
    /// As in `OperationContext[Pose]`, which says what a message is.
    #[classmethod]
    fn __class_getitem__<'py>(class: &Bound<'py, PyType>, _message: &Bound<'py, PyAny>) -> Bound<'py, PyType> {
        class.clone()
    }

    /// Simulation time in seconds.
    #[getter]
    fn now(&self) -> PyResult<f64> {
        operation(|turn| turn.now())
    }

    /// Name on the wire of the message's topic; if the operation is on a group, of the member.
    #[getter]
    fn topic(&self) -> PyResult<String> {
        operation(|turn| turn.topic())
    }

    /// The next random number, uniform in `[low, high)`. A repeated test draws the same numbers.
    #[pyo3(signature = (low = 0.0, high = 1.0))]
    fn draw(&self, low: f64, high: f64) -> PyResult<f64> {
        operation(|turn| low + (high - low) * turn.draw())
    }

    /// Drops the message. Injected messages are still delivered.
    fn drop(&self) -> PyResult<()> {
        operation(|turn| turn.drop_message())
    }

    /// Publishes a further message on the same topic, directly after this one.
    fn inject(&self, message: &Bound<'_, PyAny>) -> PyResult<()> {
        operation(|turn| turn.inject(message))?.map_err(|unfit| match unfit {
            Unfit::Raised(error) => error,
            Unfit::Mismatch(mismatch) => PyTypeError::new_err(format!("it cannot be injected: {mismatch}")),
        })
    }

    /// Marks this hook as not implemented yet.
    fn unimplemented(&self) -> PyResult<()> {
        operation(|turn| turn.unimplemented())
    }
}

/// What a hook can do before the start or after the end of a run.
#[pyclass(frozen, module = "sesamec")]
pub(crate) struct RunContext;

fn run<T>(call: impl FnOnce(&mut dyn Around) -> T) -> PyResult<T> {
    if RUN.is_set() { Ok(RUN.with(call)) } else { outside() }
}

#[pymethods]
impl RunContext {
    /// The folder of the `.sesame` file.
    #[getter]
    fn folder(&self) -> PyResult<PathBuf> {
        run(|turn| turn.folder())
    }

    /// Replaces the contents of a file until the run is over.
    fn replace_file(&self, path: &str, contents: &Bound<'_, PyAny>) -> PyResult<()> {
        let contents = match contents.extract::<String>() {
            Ok(text) => text.into_bytes(),
            Err(_) => contents.extract::<Vec<u8>>()?,
        };
        run(|turn| turn.replace_file(path, &contents))
    }

    /// Changes the text of a file until the run is over: `edit` returns the new text for the old one.
    fn edit_file(&self, path: &str, edit: &Bound<'_, PyAny>) -> PyResult<()> {
        let mut failure = None;
        run(|turn| {
            turn.edit_file(path, &mut |text| {
                let edited = edit.call1((text,)).and_then(|text| text.extract::<String>());
                edited.unwrap_or_else(|error| {
                    failure = Some(error);
                    text.to_owned()
                })
            });
        })?;
        failure.map_or(Ok(()), Err)
    }

    /// Counts another side effect, so that the test has an effect. The hook must undo it itself.
    fn count_side_effect(&self) -> PyResult<()> {
        run(|turn| turn.count_side_effect())
    }

    /// The next random number, uniform in `[low, high)`. A repeated test draws the same numbers.
    #[pyo3(signature = (low = 0.0, high = 1.0))]
    fn draw(&self, low: f64, high: f64) -> PyResult<f64> {
        run(|turn| low + (high - low) * turn.draw())
    }

    /// Marks this hook as not implemented yet.
    fn unimplemented(&self) -> PyResult<()> {
        run(|turn| turn.unimplemented())
    }
}
