use proptest::prelude::*;

use super::*;

/// Agents that are perfect.
fn perfect(agents: u32) -> Agents {
    Agents {
        agents,
        workers: 1,
        latency: 0.0,
        lifetime: None,
        absence: 0.0,
        redelivery: 0.0,
        slow: 0.0,
        slower: 1.0,
        broken_off: 0.0,
        supervisor: 0.0,
    }
}

fn campaign(tests: u32, generation: u32) -> Campaign {
    Campaign { tests, generation, durations: vec![10.0] }
}

#[test]
fn perfect_machines_share_the_tests_of_a_generation_and_wait_for_its_last() {
    for (agents, generation, wall) in
        [(1, 100, 1000.0), (4, 100, 250.0), (3, 100, 340.0), (100, 100, 10.0), (1000, 100, 10.0), (1000, 10, 100.0)]
    {
        let forecast = simulate(&perfect(agents), &campaign(100, generation), 1);
        let expected = Forecast { wall, alone: 1000.0, deliveries: 100, lost: 0, without_result: 0 };
        assert_eq!(forecast, expected, "{agents} agents, generations of {generation}");
    }
    let workers = Agents { workers: 5, ..perfect(2) };
    assert!((simulate(&workers, &campaign(100, 100), 1).wall - 100.0).abs() < 1e-9);
}

#[test]
fn latency_and_the_supervisor_take_their_time() {
    let slow_network = Agents { latency: 5.0, ..perfect(1) };
    let mean = (0..20).map(|seed| simulate(&slow_network, &campaign(100, 100), seed).wall).sum::<f64>() / 20.0;
    // Each test comes 5 s after its worker was free; the last result takes 5 s more.
    assert!((mean - 1505.0).abs() < 30.0, "{mean}");
    let busy = Agents { supervisor: 1.0, ..perfect(1000) };
    assert!((simulate(&busy, &campaign(100, 100), 1).wall - 110.0).abs() < 1e-9);
    // The next generation waits for it.
    assert!((simulate(&busy, &campaign(100, 10), 1).wall - 200.0).abs() < 1e-9);
}

#[test]
fn what_lost_machines_had_taken_is_run_by_others() {
    let lost = Agents { lifetime: Some(100.0), absence: 20.0, redelivery: 2.0, ..perfect(10) };
    let forecast = simulate(&lost, &campaign(1000, 1000), 3);
    assert!(forecast.lost > 50 && forecast.deliveries > 1020, "{forecast:?}");
    assert_eq!(forecast.without_result, 0);
    // A part of the time they are not there, and what they had begun is lost.
    assert!(forecast.wall > 1000.0 * (1.0 + 20.0 / 100.0) && forecast.wall < 1500.0, "{forecast:?}");
}

#[test]
fn a_campaign_ends_if_every_machine_was_put_aside() {
    let forecast = simulate(&Agents { broken_off: 1.0, ..perfect(3) }, &campaign(100, 100), 1);
    assert!(forecast.without_result > 0 && forecast.wall.is_finite(), "{forecast:?}");
}

#[test]
fn ten_thousand_agents_are_no_trouble() {
    let many = Agents { latency: 0.005, lifetime: Some(86400.0), absence: 60.0, redelivery: 2.0, ..perfect(10_000) };
    let forecast = simulate(&many, &Campaign { tests: 50_000, generation: 50_000, durations: vec![60.0, 90.0] }, 1);
    assert_eq!(forecast.without_result, 0);
    assert!(forecast.wall > 360.0 && forecast.wall < 480.0, "{forecast:?}");
}

proptest! {
    /// A naive judge: with perfect machines, tests go one after the other to the machine that is free first.
    #[test]
    fn perfect_machines_take_as_long_as_a_list_scheduler(
        agents in 1u32..8,
        workers in 1u32..3,
        tests in 1u32..60,
        generation in 1u32..30,
        durations in prop::collection::vec(1.0f64..100.0, 1..5),
        seed in any::<u64>(),
    ) {
        let campaign = Campaign { tests, generation, durations };
        let forecast = simulate(&Agents { workers, ..perfect(agents) }, &campaign, seed);
        let mut luck = Stream::derive(seed, "tests", &[]);
        let all: Vec<f64> = (0..tests).map(|_| campaign.durations[luck.below(campaign.durations.len())]).collect();
        let mut wall = 0.0f64;
        for generation in all.chunks(generation as usize) {
            let mut free = vec![wall; (agents * workers) as usize];
            for test in generation {
                let first = free.iter_mut().min_by(|a, b| a.total_cmp(b)).unwrap();
                *first += test;
            }
            wall = free.iter().copied().fold(wall, f64::max);
        }
        prop_assert!((forecast.wall - wall).abs() < 1e-6, "{} instead of {wall}", forecast.wall);
    }

    /// However bad machines and network are, each test has one result or none, and nothing goes on for ever.
    #[test]
    fn each_test_has_a_result_as_long_as_machines_are_there(
        agents in 1u32..20,
        latency in 0.0f64..5.0,
        lifetime in prop::option::of(50.0f64..1000.0),
        slow in 0.0f64..1.0,
        seed in any::<u64>(),
    ) {
        let agents = Agents {
            latency, lifetime, absence: 10.0, redelivery: 2.0, slow, slower: 3.0, ..perfect(agents)
        };
        let forecast = simulate(&agents, &campaign(50, 20), seed);
        prop_assert!(forecast.wall.is_finite() && forecast.deliveries >= 50);
        prop_assert!(lifetime.is_some() || forecast.without_result == 0, "{:?}", forecast);
        prop_assert_eq!(forecast, simulate(&agents, &campaign(50, 20), seed));
    }
}
