//! The searches of `sesame-optimise` on vectors of the unit box, for the interfaces of other optimisers.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use sesame_optimise::dominance::{Fitness, Unfit};
use sesame_optimise::falsify::{self, Falsifier, Margin, UnitBox};
use sesame_optimise::nsga2::{self, Nsga2, Survival, Told};
use sesame_optimise::problems::RealVariation;

/// NSGA-II, or NSGA-III, with the usual variation of real numbers.
#[pyclass(module = "sesamec._native")]
pub(crate) struct Evolution {
    search: Nsga2<RealVariation>,
    /// What was asked for last and is not told yet.
    asked: Vec<Vec<f64>>,
    told: u32,
}

#[pymethods]
impl Evolution {
    /// A search in so many variables, without a limit of evaluations.
    #[new]
    fn new(variables: usize, population: u32, seed: u64, reference_points: bool) -> PyResult<Self> {
        if variables == 0 || population == 0 {
            return Err(PyValueError::new_err("a search has variables, and a population has members"));
        }
        let survival = if reference_points { Survival::ReferencePoints } else { Survival::Crowded };
        let settings = nsga2::Settings { population, evaluations: u32::MAX, seed, survival };
        let search = Nsga2::new(settings, RealVariation::usual(variables, seed));
        Ok(Evolution { search, asked: Vec::new(), told: 0 })
    }

    /// The next generation, each vector in `0..=1`.
    fn ask(&mut self) -> PyResult<Vec<Vec<f64>>> {
        if !self.asked.is_empty() {
            return Err(PyValueError::new_err("a generation is told before the next is asked for"));
        }
        self.asked = self.search.ask().into_iter().map(|asked| asked.genome).collect();
        Ok(self.asked.clone())
    }

    /// Takes the objectives of exactly the generation that was asked for, in its order, all to be minimised; `None` for
    /// a vector that could not be evaluated.
    fn tell(&mut self, objectives: Vec<Option<Vec<f64>>>) -> PyResult<()> {
        let first = objectives.iter().flatten().next().map(Vec::len);
        let is_good = |values: &Vec<f64>| {
            Some(values.len()) == first && !values.is_empty() && values.iter().all(|value| value.is_finite())
        };
        if objectives.len() != self.asked.len() || !objectives.iter().flatten().all(is_good) {
            return Err(PyValueError::new_err(
                "each vector of the generation has as many finite objectives as the others",
            ));
        }
        let begin = self.told;
        self.told += u32::try_from(objectives.len()).unwrap_or(u32::MAX);
        let told =
            (begin..).zip(std::mem::take(&mut self.asked)).zip(objectives).map(|((number, genome), objectives)| Told {
                number,
                genome,
                fitness: objectives.map_or(Fitness::Unfit(Unfit::Crash), Fitness::Measured),
            });
        self.search.tell(told);
        Ok(())
    }

    /// The vectors that survived, by their numbers: how many were told before them.
    fn survivors(&self) -> Vec<u32> {
        self.search.population().iter().map(|member| member.number).collect()
    }
}

/// A search for a violation by a Gaussian process, where evaluations are expensive.
#[pyclass(module = "sesamec._native")]
pub(crate) struct Falsification {
    search: Falsifier<UnitBox>,
    requirements: usize,
    /// What was asked for last and is not told yet.
    asked: Vec<Vec<f64>>,
}

#[pymethods]
impl Falsification {
    /// A search in so many variables for a violation of any of these requirements.
    #[new]
    fn new(variables: usize, requirements: usize, seed: u64) -> PyResult<Self> {
        if variables == 0 || requirements == 0 {
            return Err(PyValueError::new_err("a search has variables and a requirement"));
        }
        let settings = falsify::Settings { requirements, evaluations: u32::MAX, batch: 1, seed };
        let search = Falsifier::new(UnitBox::new(variables, seed), settings);
        Ok(Falsification { search, requirements, asked: Vec::new() })
    }

    /// The next vectors, each in `0..=1`: several at first, then one.
    fn ask(&mut self) -> PyResult<Vec<Vec<f64>>> {
        if !self.asked.is_empty() {
            return Err(PyValueError::new_err("vectors are told before the next are asked for"));
        }
        self.asked = self.search.ask();
        Ok(self.asked.clone())
    }

    /// Takes the margins of exactly the vectors that were asked for, in their order, one for each requirement: negative
    /// if it is violated, `None` if that is not known.
    fn tell(&mut self, margins: Vec<Option<Vec<f64>>>) -> PyResult<()> {
        let requirements = self.requirements;
        let is_good = |values: &Vec<f64>| values.len() == requirements && values.iter().all(|value| value.is_finite());
        if margins.len() != self.asked.len() || !margins.iter().flatten().all(is_good) {
            return Err(PyValueError::new_err("each vector has a finite margin of each requirement"));
        }
        let known = |value: f64| Margin { value: Some(value), violated: value < 0.0 };
        let unknown = Margin { value: None, violated: false };
        let margins = margins.into_iter().map(|values| match values {
            Some(values) => values.into_iter().map(known).collect(),
            None => vec![unknown; requirements],
        });
        self.search.tell(std::mem::take(&mut self.asked).into_iter().zip(margins).collect());
        Ok(())
    }
}
