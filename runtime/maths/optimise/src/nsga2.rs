//! NSGA-II [Deb et al. 2002] by ask and tell, over any genome.
//!
//! Generation 0 is fresh; each later one is as large as the population, bred from it by binary tournaments and the
//! genome's own [`Variation`], and the best of both together survive. What is asked depends on the seed and on what
//! was told, never on the duration or the order of evaluations.

use sesame_rng::Stream;

use crate::dominance::Fitness;
use crate::nsga3::ReferencePoints;
use crate::selection::{Rank, distinct_survivors, parents, survivors};

/// How genomes of a kind are made and changed. Randomness comes from streams of the given coordinates only.
pub trait Variation {
    /// What is evolved.
    type Genome: Clone;

    /// The `index`th genome of generation 0.
    fn initial(&mut self, index: u64) -> Self::Genome;

    /// The two children of the `pair`th pair of parents in a generation. The last one's second child is not evaluated
    /// when the generation is odd.
    fn offspring(&mut self, parents: [&Self::Genome; 2], generation: u64, pair: u64) -> [Child<Self::Genome>; 2];
}

/// A new genome, and where it comes from.
#[derive(Debug, Clone, PartialEq)]
pub struct Child<G> {
    /// The genome.
    pub genome: G,
    /// Whose genes it has.
    pub heritage: Heritage,
}

/// Which of two parents a child has genes of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Heritage {
    /// From the first alone.
    First,
    /// From the second alone.
    Second,
    /// From both.
    Both,
}

/// The sizes of a run, its seed, and who survives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Settings {
    /// Members of the population, and of each generation; at least 1.
    pub population: u32,
    /// Genomes evaluated in total; the last generation is cut short to meet it exactly.
    pub evaluations: u32,
    /// The seed of selection.
    pub seed: u64,
    /// Who survives.
    pub survival: Survival,
}

/// Who survives of a population and its offspring.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Survival {
    /// The best by the crowded comparison, as in the paper.
    Crowded,
    /// Only one solution among those with equal objective values survives, as long as there are others. The crowded
    /// comparison would fill the population with equal solutions where there are many.
    Distinct,
    /// By reference points, as in NSGA-III: for three and more objectives.
    ReferencePoints,
}

/// A genome to be evaluated.
#[derive(Debug, Clone, PartialEq)]
pub struct Asked<G> {
    /// The genome.
    pub genome: G,
    /// The numbers, as told, of the genomes it descends from; none in generation 0, else one or two.
    pub parents: Vec<u32>,
}

/// An evaluated genome.
#[derive(Debug, Clone, PartialEq)]
pub struct Told<G> {
    /// The caller's number for it; what [`Asked::parents`] refers to.
    pub number: u32,
    /// The genome, as asked.
    pub genome: G,
    /// Its fitness.
    pub fitness: Fitness,
}

/// A run of NSGA-II.
#[derive(Debug, Clone)]
pub struct Nsga2<V: Variation> {
    settings: Settings,
    variation: V,
    /// The generation that [`Nsga2::ask`] gives next.
    generation: u32,
    /// Genomes asked so far.
    asked: u32,
    /// How many of them still have to be told.
    awaited: usize,
    population: Vec<Told<V::Genome>>,
    ranks: Vec<Rank>,
    /// What [`Survival::ReferencePoints`] has seen.
    reference_points: ReferencePoints,
}

impl<V: Variation> Nsga2<V> {
    /// A run before its first generation.
    pub fn new(settings: Settings, variation: V) -> Self {
        assert!(settings.population > 0, "a population has at least one member");
        Nsga2 {
            settings,
            variation,
            generation: 0,
            asked: 0,
            awaited: 0,
            population: Vec::new(),
            ranks: Vec::new(),
            reference_points: ReferencePoints::default(),
        }
    }

    /// The generation that [`Nsga2::ask`] gives next, from 0.
    pub fn generation(&self) -> u32 {
        self.generation
    }

    /// How its genomes are varied.
    pub fn variation(&self) -> &V {
        &self.variation
    }

    /// How its genomes are varied, for variation that learns from results.
    pub fn variation_mut(&mut self) -> &mut V {
        &mut self.variation
    }

    /// The surviving genomes, by the order in which they were asked.
    pub fn population(&self) -> &[Told<V::Genome>] {
        &self.population
    }

    /// Updates the fitness of the surviving genomes, for fitness that depends on other genomes. They are ranked again
    /// when the next generation is told.
    pub fn update_fitness(&mut self, mut fitness: impl FnMut(&Told<V::Genome>) -> Fitness) {
        for member in &mut self.population {
            member.fitness = fitness(member);
        }
    }

    /// The next generation; empty when all evaluations are used up.
    pub fn ask(&mut self) -> Vec<Asked<V::Genome>> {
        assert!(self.awaited == 0, "a generation is told before the next is asked");
        let size = self.settings.population.min(self.settings.evaluations - self.asked);
        let batch = if self.generation == 0 {
            let fresh = |index| Asked { genome: self.variation.initial(u64::from(index)), parents: Vec::new() };
            (0..size).map(fresh).collect()
        } else {
            self.breed(size)
        };
        self.asked += size;
        self.awaited = batch.len();
        self.generation += 1;
        batch
    }

    /// Takes the results of exactly the generation asked last, in its order.
    pub fn tell(&mut self, results: impl IntoIterator<Item = Told<V::Genome>>) {
        let before = self.population.len();
        self.population.extend(results);
        assert!(self.population.len() - before == self.awaited, "exactly the generation asked last is told");
        self.awaited = 0;
        let size = self.settings.population as usize;
        let fitness: Vec<&Fitness> = self.population.iter().map(|member| &member.fitness).collect();
        let survivors = match self.settings.survival {
            Survival::Crowded => survivors(&fitness, size),
            Survival::Distinct => distinct_survivors(&fitness, size),
            Survival::ReferencePoints => {
                let mut stream = Stream::derive(self.settings.seed, "niching", &[u64::from(self.generation)]);
                self.reference_points.survivors(&fitness, size, &mut stream)
            }
        };
        let mut chosen = survivors.iter().map(|(position, _)| *position).peekable();
        let mut position = 0;
        self.population.retain(|_| {
            position += 1;
            chosen.next_if_eq(&(position - 1)).is_some()
        });
        self.ranks = survivors.into_iter().map(|(_, rank_of)| rank_of).collect();
    }

    fn breed(&mut self, size: u32) -> Vec<Asked<V::Genome>> {
        let generation = u64::from(self.generation);
        let pairs = size.div_ceil(2);
        let mut stream = Stream::derive(self.settings.seed, "mating", &[generation]);
        let mating = parents(&self.ranks, 2 * pairs as usize, &mut stream);
        let mut batch = Vec::with_capacity(size as usize + 1);
        for (pair, couple) in (0u64..).zip(mating.chunks_exact(2)) {
            let [first, second] = [&self.population[couple[0]], &self.population[couple[1]]];
            for child in self.variation.offspring([&first.genome, &second.genome], generation, pair) {
                let parents = match child.heritage {
                    Heritage::First => vec![first.number],
                    Heritage::Second => vec![second.number],
                    Heritage::Both if first.number == second.number => vec![first.number],
                    Heritage::Both => vec![first.number, second.number],
                };
                batch.push(Asked { genome: child.genome, parents });
            }
        }
        batch.truncate(size as usize);
        batch
    }
}
