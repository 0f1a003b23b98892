//! The jobs for GitLab, as far as bash goes.

use sesame_tests::workspace;

use crate::steps::{Checkout, SPACE, gitlab_script, read};

#[test]
fn its_jobs_leave_junit_and_fail_as_their_comments_say() {
    let Some(checkout) = Checkout::new("gitlab") else { return };
    let file = read(&workspace().join("examples/ci/gitlab-ci.yml"));
    std::fs::create_dir(checkout.folder.join("sesame-results")).unwrap();
    let environment =
        [("SPACE", SPACE), ("CI_PIPELINE_IID", "1")].map(|(name, value)| (name.to_owned(), value.to_owned()));

    let night = checkout.bash(&gitlab_script(&file, "night"), &environment).expect(3);
    assert!(night.err.contains("not as required: R1 is violated in"), "{}", night.err);
    assert!(read(&checkout.folder.join("sesame-results/campaign.xml")).contains("<failure"));

    checkout.keep("sesame-results/1", &["T2", "--pin"]);
    checkout.bash(&gitlab_script(&file, "change"), &environment).expect(0);
    assert!(read(&checkout.folder.join("sesame-results/regression-tests.xml")).contains("first_T2"));
}
