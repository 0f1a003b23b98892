//! NSGA-II on ZDT1, with the hypervolume of its population beside that of the exact front.

use sesame_optimise::dominance::Fitness;
use sesame_optimise::hypervolume::hypervolume;
use sesame_optimise::nsga2::{Nsga2, Settings, Survival, Told};
use sesame_optimise::problems::{Problem, RealVariation};

fn main() {
    let problem = Problem::Zdt1;
    let settings = Settings { population: 100, evaluations: 25_000, seed: 1, survival: Survival::Crowded };
    let mut search = Nsga2::new(settings, RealVariation::usual(problem.variables(), 1));
    let mut numbers = 0..;
    loop {
        let asked = search.ask();
        if asked.is_empty() {
            break;
        }
        let evaluated = asked.into_iter().zip(&mut numbers).map(|(asked, number)| {
            let fitness = Fitness::Measured(problem.evaluate(&asked.genome));
            Told { number, genome: asked.genome, fitness }
        });
        let evaluated: Vec<_> = evaluated.collect();
        search.tell(evaluated);
    }
    let points: Vec<&[f64]> = search.population().iter().filter_map(|member| member.fitness.objectives()).collect();
    let found = hypervolume(&points, problem.reference());
    println!("hypervolume {found:.4}, the exact front has {:.4}", problem.exact_hypervolume());
}
