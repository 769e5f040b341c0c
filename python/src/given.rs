//! Arguments from Python: numbers by name or in order, points, names. An argument without names must have the right length. Every error
//! names the argument.

use nalgebra::SVector;
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyFloat, PyList, PyMapping, PyString, PyTuple};

use super::errors::wrong;

/// Numbers of an argument.
pub enum Given {
    /// By name: a mapping, a Series with names in its index, an xarray with names in a coordinate, a named tuple.
    Named(Vec<(String, f64)>),
    /// In order: a list, a tuple, an array.
    Listed(Vec<f64>),
}

impl Given {
    /// Reads the argument `what`.
    ///
    /// # Errors
    /// Another type, names that are not text or repeated, values that are not numbers.
    pub fn read(what: &str, given: &Bound<'_, PyAny>) -> PyResult<Self> {
        if let Ok(dict) = given.cast::<PyDict>() {
            return named(what, dict.iter());
        }
        if let Some(array) = plain_array::<PyArray1<f64>>(given) {
            return Ok(Self::Listed(array.readonly().as_array().to_vec()));
        }
        if let Ok(list) = given.cast::<PyList>() {
            return list.iter().map(|n| number(what, &n)).collect::<PyResult<_>>().map(Self::Listed);
        }
        if let Ok(mapping) = given.cast::<PyMapping>() {
            let items: Vec<_> =
                mapping.items()?.iter().map(|item| item.extract()).collect::<PyResult<_>>()?;
            return named(what, items.into_iter());
        }
        if given.is_instance_of::<PyTuple>() && given.hasattr("_asdict")? {
            return Self::read(what, &given.call_method0("_asdict")?);
        }
        let given = in_pandas(what, given, 1)?;
        if given.hasattr("index")? && given.hasattr("items")? {
            if given.hasattr("columns")? {
                return Err(wrong(format!("{what} has two axes; it must have one")));
            }
            let labels: Vec<Bound<'_, PyAny>> =
                given.getattr("index")?.try_iter()?.collect::<PyResult<_>>()?;
            if !labels.is_empty() && !counts(&labels) {
                let values: Vec<_> = given.try_iter()?.collect::<PyResult<_>>()?;
                return named(what, labels.into_iter().zip(values));
            }
        }
        let (shape, values) = floats(what, &given)?;
        if shape.len() != 1 {
            return Err(wrong(format!("{what} has {} axes; it must have one", shape.len())));
        }
        Ok(Self::Listed(values))
    }

    /// The two coordinates of the argument `what`: x and y by name, or two numbers.
    ///
    /// # Errors
    /// Those of [`Given::read`], other names, another length.
    pub fn pair(what: &str, given: &Bound<'_, PyAny>) -> PyResult<SVector<f64, 2>> {
        match Self::read(what, given)? {
            Self::Listed(values) => match values[..] {
                [x, y] => Ok(SVector::from([x, y])),
                _ => Err(wrong(format!("{what} has {} numbers; it must have two, x and y", values.len()))),
            },
            Self::Named(values) => {
                let of = |name: &str| values.iter().find(|(n, _)| n == name).map(|(_, value)| *value);
                match (values.len(), of("x"), of("y")) {
                    (2, Some(x), Some(y)) => Ok(SVector::from([x, y])),
                    _ => {
                        let names: Vec<&str> = values.iter().map(|(n, _)| n.as_str()).collect();
                        Err(wrong(format!("{what} has the names {}; they must be x and y", names.join(", "))))
                    }
                }
            }
        }
    }
}

/// The points of the argument `what`, of shape (`count`, 2), or with the columns x and y.
///
/// # Errors
/// Another shape or other columns, values that are not finite numbers.
pub fn points(what: &str, given: &Bound<'_, PyAny>, count: usize) -> PyResult<Vec<SVector<f64, 2>>> {
    let points = read_points(what, given, count)?;
    match points.iter().position(|p| !p.iter().all(|x| x.is_finite())) {
        Some(node) => {
            Err(wrong(format!("{what}: {:?} at node {node} (from 0) is not finite", points[node].as_slice())))
        }
        None => Ok(points),
    }
}

fn read_points(what: &str, given: &Bound<'_, PyAny>, count: usize) -> PyResult<Vec<SVector<f64, 2>>> {
    if let Some(array) = plain_array::<PyArray2<f64>>(given)
        && array.shape() == [count, 2]
    {
        let array = array.readonly();
        return Ok(array.as_array().rows().into_iter().map(|row| SVector::from([row[0], row[1]])).collect());
    }
    let mut given = in_pandas(what, given, 2)?;
    if given.hasattr("columns")? && given.hasattr("index")? {
        let labels =
            |axis: &str| given.getattr(axis)?.try_iter()?.collect::<PyResult<Vec<Bound<'_, PyAny>>>>();
        let (rows, columns) = (labels("index")?, labels("columns")?);
        if !counts(&rows) {
            return Err(wrong(format!(
                "{what} has an index that does not count the nodes from 0; use reset_index(drop=True) \
                 where the rows are in the order of the nodes"
            )));
        }
        if !counts(&columns) {
            let names: Vec<String> = columns.iter().map(ToString::to_string).collect();
            let mut sorted = names.clone();
            sorted.sort_unstable();
            if sorted != ["x", "y"] {
                return Err(wrong(format!(
                    "{what} has the columns {}; they must be x and y",
                    names.join(", ")
                )));
            }
            given = given.get_item(vec!["x", "y"])?;
        }
    }
    let (shape, values) = floats(what, &given)?;
    if shape != [count, 2] {
        let sizes: Vec<String> = shape.iter().map(ToString::to_string).collect();
        return Err(wrong(format!("{what} has the shape ({}); it must be ({count}, 2)", sizes.join(", "))));
    }
    Ok(values.chunks_exact(2).map(|p| SVector::from([p[0], p[1]])).collect())
}

/// The names in the argument `what`, in their order; a text is one name.
///
/// # Errors
/// Anything but a text or a sequence of texts; also sets, because they have no order.
pub fn names(what: &str, given: &Bound<'_, PyAny>) -> PyResult<Vec<String>> {
    if let Ok(one) = given.cast::<PyString>() {
        return Ok(vec![one.to_string()]);
    }
    let refuse = || wrong(format!("{what} must be a name or a list of names, not {}", shortened(given)));
    let unordered = given.py().import("collections.abc")?.getattr("Set")?;
    if given.is_instance_of::<PyBytes>() || given.is_instance(&unordered)? {
        return Err(refuse());
    }
    let items = given.try_iter().map_err(|_| refuse())?;
    items
        .map(|item| {
            let item = item?;
            let name = item.cast::<PyString>().map_err(|_| {
                wrong(format!("{what} must be a list of names; {} among them is none", shortened(&item)))
            })?;
            Ok(name.to_string())
        })
        .collect()
}

/// The number in the argument `what`.
///
/// # Errors
/// Anything but a number.
pub fn number(what: &str, given: &Bound<'_, PyAny>) -> PyResult<f64> {
    if let Ok(float) = given.cast_exact::<PyFloat>() {
        return Ok(float.value());
    }
    let refuse = || wrong(format!("{what} has {} where a number is needed", shortened(given)));
    if given.is_instance_of::<PyString>() || given.is_instance_of::<PyBytes>() {
        return Err(refuse());
    }
    given.extract().map_err(|_| refuse())
}

/// A value for messages; long ones are shortened.
fn shortened(given: &Bound<'_, PyAny>) -> String {
    let text = given.repr().map_or_else(|_| "something".to_owned(), |text| text.to_string());
    let mut letters = text.chars();
    let start: String = letters.by_ref().take(60).map(|c| if c.is_control() { ' ' } else { c }).collect();
    if letters.next().is_some() { format!("{start}...") } else { start }
}

fn named<'py>(
    what: &str,
    items: impl Iterator<Item = (Bound<'py, PyAny>, Bound<'py, PyAny>)>,
) -> PyResult<Given> {
    let mut read: Vec<(String, f64)> = Vec::new();
    for (name, value) in items {
        let Ok(text) = name.cast::<PyString>() else {
            return Err(wrong(format!("{what} has {} where a name is needed", shortened(&name))));
        };
        let text = text.to_string();
        if read.iter().any(|(known, _)| *known == text) {
            return Err(wrong(format!("{what} has the name {text} twice")));
        }
        let value = number(&format!("{what}: {text}"), &value)?;
        read.push((text, value));
    }
    Ok(Given::Named(read))
}

/// Whether labels are 0, 1, 2 and so on, as unnamed data have by default.
fn counts(labels: &[Bound<'_, PyAny>]) -> bool {
    let is = |(n, label): (usize, &Bound<'_, PyAny>)| label.extract::<usize>().is_ok_and(|l| l == n);
    labels.iter().enumerate().all(is)
}

/// A numpy array whose memory can be read directly; `None` for subclasses with masks or units.
fn plain_array<'a, 'py, T: pyo3::PyTypeCheck>(given: &'a Bound<'py, PyAny>) -> Option<&'a Bound<'py, T>> {
    // The name of the type is checked first, because `cast` imports numpy.
    let plain = given.get_type().name().is_ok_and(|name| name == "ndarray");
    let aligned = || given.getattr("flags").and_then(|f| f.getattr("aligned")?.is_truthy());
    if plain && aligned().unwrap_or(false) { given.cast::<T>().ok() } else { None }
}

/// An xarray array with `axes` axes as a pandas Series or DataFrame whose labels are the names of a coordinate; otherwise the argument
/// itself.
fn in_pandas<'py>(what: &str, given: &Bound<'py, PyAny>, axes: usize) -> PyResult<Bound<'py, PyAny>> {
    if !given.hasattr("dims")? || !given.hasattr("to_pandas")? {
        return Ok(given.clone());
    }
    let dims: Vec<String> = given.getattr("dims")?.extract()?;
    if dims.len() != axes {
        return Err(wrong(format!("{what} has {} axes; it must have {axes}", dims.len())));
    }
    let coords = given.getattr("coords")?;
    let mut labelled = given.clone();
    for dim in &dims {
        if coords.contains(dim)? {
            continue;
        }
        // The names may be in a coordinate along this axis that has another name.
        for name in coords.try_iter()? {
            let coord = coords.get_item(name?)?;
            let along: Vec<String> = coord.getattr("dims")?.extract()?;
            let kind: String = coord.getattr("dtype")?.getattr("kind")?.extract()?;
            if along == [dim.as_str()] && matches!(kind.as_str(), "U" | "O" | "T") {
                let swap = PyDict::new(given.py());
                swap.set_item(dim, coord.getattr("name")?)?;
                labelled = labelled.call_method1("swap_dims", (swap,))?;
                break;
            }
        }
    }
    labelled.call_method0("to_pandas")
}

/// Shape and values of anything that numpy can convert to numbers.
fn floats(what: &str, given: &Bound<'_, PyAny>) -> PyResult<(Vec<usize>, Vec<f64>)> {
    let refuse = || wrong(format!("{what} must be numbers, not {}", shortened(given)));
    if given.is_none() || given.is_instance_of::<PyString>() || given.is_instance_of::<PyBytes>() {
        return Err(refuse());
    }
    // Only masked arrays of numpy have both attributes.
    if given.hasattr("fill_value")?
        && let Some(mask) = given.getattr_opt("mask")?
        && mask.call_method0("any")?.is_truthy()?
    {
        return Err(wrong(format!("{what} has values that are masked; a number is needed for each")));
    }
    let numpy = given.py().import("numpy")?;
    let array = numpy.call_method1("asarray", (given,)).map_err(|_| refuse())?;
    let dtype = array.getattr("dtype")?;
    if !dtype.getattr("names")?.is_none() {
        return Err(wrong(format!("{what} has named fields; give a dict")));
    }
    let kind: String = dtype.getattr("kind")?.extract()?;
    // With missing values pandas returns objects or, for integers, floats.
    if given.getattr_opt("isna")?.is_some_and(|isna| isna.is_callable())
        && given.getattr("dtype").is_ok_and(|d| d.hasattr("na_value").unwrap_or(false))
        && given.call_method0("isna")?.call_method0("any")?.is_truthy()?
    {
        return Err(refuse());
    }
    let plain = match kind.as_str() {
        "i" | "u" | "f" | "O" => array.call_method1("astype", ("float64", "C")),
        _ => return Err(refuse()),
    };
    let plain = plain.map_err(|_| refuse())?;
    let plain: PyReadonlyArrayDyn<'_, f64> = plain.extract().map_err(|_| refuse())?;
    Ok((plain.shape().to_vec(), plain.as_array().iter().copied().collect()))
}
