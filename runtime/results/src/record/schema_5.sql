-- Results of three tests of `kuka_cell`, campaign `coverage_experiment`, as a runner of schema 5 recorded them; of each
-- series the first four points. That runner's digest of it is
-- 159582fa2a626aa26bdf7fa872956f1725ec44b8bf8bda977ea7e54205246737.
PRAGMA foreign_keys=OFF;
BEGIN TRANSACTION;
CREATE TABLE campaign (
    id              INTEGER PRIMARY KEY CHECK (id = 1),
    space           TEXT NOT NULL,
    name            TEXT NOT NULL,
    source          TEXT NOT NULL,  -- file name of the .sesame file
    generator       TEXT NOT NULL,  -- program and version that generated the runner
    runtime         TEXT NOT NULL,  -- version of the runtime that ran it
    seed            TEXT NOT NULL,  -- the one seed that decided everything
    evaluations     INTEGER NOT NULL, -- tests the search was to evaluate
    end_after_s     REAL NOT NULL,  -- simulation time at which a test ends
    plan            TEXT NOT NULL,  -- everything the runner knew of the campaign, JSON
    stop            TEXT            -- why the run ended; NULL while it is unfinished
) STRICT;
INSERT INTO campaign VALUES(1,'kuka_cell','coverage_experiment','kuka_cell.sesame','sesamec 0.1.0','0.1.0','42',3,70.0,'{"schema":1,"generator":"sesamec 0.1.0","source":"kuka_cell.sesame","space":"kuka_cell","doc":"The KUKA gearbox cell: three robots on sliding conveyors, workers around them.","simulator":{"name":"cell","transport":{"kind":"in_process","path":"kuka_cell_sim::Cell","step_ns":20000000}},"messages":[{"name":"SafetyZone","doc":"How far things are from each other; published every step.","fields":[{"name":"zone","doc":"Name of the zone, or of the pair of arms.","type":{"kind":"text"}},{"name":"level","doc":"Distance of the gripper sphere''s surface to the zone, negative inside; between two arms, of their surfaces.","type":{"kind":"real","unit":"mm"}},{"name":"object1","doc":"What is watched.","type":{"kind":"text"}},{"name":"object2","doc":"What came nearest to it.","type":{"kind":"text"}}]}],"topics":[{"name":"link0","doc":"Target of the first axis (the column) of the arm that moves the product.","paths":["joints/R3200ProductMove/Link0/R/position"],"type":{"kind":"real","unit":"rad"}},{"name":"link1","doc":"Target of its second axis (the lower arm).","paths":["joints/R3200ProductMove/Link1/R/position"],"type":{"kind":"real","unit":"rad"}},{"name":"zones","doc":"Where people work next to the cell.","paths":["safetyzones/Z1","safetyzones/Z2","safetyzones/Z3"],"type":{"kind":"message","id":0}},{"name":"near1","doc":"Where the gripper picks, carries and places near people: places that a disturbance is timed by.","paths":["safetyzones/ZTRIG1"],"type":{"kind":"message","id":0}},{"name":"near2","doc":"","paths":["safetyzones/ZTRIG2"],"type":{"kind":"message","id":0}},{"name":"near3","doc":"","paths":["safetyzones/ZTRIG3"],"type":{"kind":"message","id":0}},{"name":"arms","doc":"The product arm against the two assembly arms.","paths":["safetyzones/ZR270073","safetyzones/ZR270072"],"type":{"kind":"message","id":0}},{"name":"speed","doc":"The fastest gripper.","paths":["cell/gripper_speed"],"type":{"kind":"real","unit":"m/s"}},{"name":"cycle","doc":"How long a cycle took; published when it completes.","paths":["cell/cycle_time"],"type":{"kind":"real","unit":"s"}}],"nodes":[{"name":"plc","doc":"","publishes":[0,1,8],"subscribes":[]},{"name":"r3200","doc":"","publishes":[2,3,4,5,6,7],"subscribes":[0,1]}],"metrics":[{"name":"collision_occurrence","doc":"R1: intervals of 0.2 s in which the gripper was inside a safety zone.","unit":null,"direction":"maximise","default":0.0,"initial":null,"source":{"kind":"hook","topics":[2]},"trend":"rising","line":42},{"name":"top_speed","doc":"R2: the highest speed of any gripper.","unit":"m/s","direction":"maximise","default":0.0,"initial":null,"source":{"kind":"hook","topics":[7]},"trend":"rising","line":45},{"name":"closest_approach","doc":"R3: the closest approach of the product arm to an assembly arm.","unit":"mm","direction":"minimise","default":5000.0,"initial":null,"source":{"kind":"hook","topics":[6]},"trend":"falling","line":48},{"name":"cycle_time","doc":"R4: how long the cycle took; a cycle that never completed counts as 999 s.","unit":"s","direction":null,"default":999.0,"initial":null,"source":{"kind":"last","input":{"topic":8,"path":[]}},"line":51},{"name":"fuzzing_time","doc":"How much a test disturbs: the less it takes, the worse.","unit":"s","direction":"minimise","default":null,"initial":null,"source":{"kind":"fuzzing_time"},"trend":"rising","line":54},{"name":"link0_low","doc":"","unit":null,"direction":null,"default":null,"initial":0.0,"source":{"kind":"formula","formula":{"inputs":[{"field":{"topic":0,"path":[]},"members":"min"}],"aggregate":{"kind":"last","of":{"product":[{"divide":{"value":{"sum":[{"negate":{"input":0}},{"negate":{"constant":2.5}}]},"by":{"constant":0.642}}},{"constant":10.0}]}},"when":{"compare":{"left":{"input":0},"by":"below","right":{"constant":-2.5}}},"every":null,"per":null,"side":"inbound"}},"line":58},{"name":"near_zone1","doc":"How near the gripper is to a place, on a scale from 10; at 10 until it is.","unit":null,"direction":null,"default":null,"initial":10.0,"source":{"kind":"formula","formula":{"inputs":[{"field":{"topic":3,"path":["level"]},"members":"min"}],"aggregate":{"kind":"last","of":{"product":[{"divide":{"value":{"input":0},"by":{"constant":300.0}}},{"constant":10.0}]}},"when":{"compare":{"left":{"input":0},"by":"below","right":{"constant":300.0}}},"every":null,"per":null,"side":"inbound"}},"line":63},{"name":"near_zone2","doc":"","unit":null,"direction":null,"default":null,"initial":10.0,"source":{"kind":"formula","formula":{"inputs":[{"field":{"topic":4,"path":["level"]},"members":"min"}],"aggregate":{"kind":"last","of":{"product":[{"divide":{"value":{"input":0},"by":{"constant":300.0}}},{"constant":10.0}]}},"when":{"compare":{"left":{"input":0},"by":"below","right":{"constant":300.0}}},"every":null,"per":null,"side":"inbound"}},"line":64},{"name":"near_zone3","doc":"","unit":null,"direction":null,"default":null,"initial":10.0,"source":{"kind":"formula","formula":{"inputs":[{"field":{"topic":5,"path":["level"]},"members":"min"}],"aggregate":{"kind":"last","of":{"product":[{"divide":{"value":{"input":0},"by":{"constant":300.0}}},{"constant":10.0}]}},"when":{"compare":{"left":{"input":0},"by":"below","right":{"constant":300.0}}},"every":null,"per":null,"side":"inbound"}},"line":65}],"requirements":[{"name":"R1","text":"Robots stay out of the safety zones of the operators","metric":0,"bound":{"kind":"at_most","value":0.0}},{"name":"R2","text":"Robots move within their speed limit","metric":1,"bound":{"kind":"at_most","value":2.0}},{"name":"R3","text":"Robots keep away from each other","metric":2,"bound":{"kind":"at_least","value":200.0}},{"name":"R4","text":"The cell completes its cycle in time","metric":3,"bound":{"kind":"at_most","value":70.0}}],"operations":[{"name":"jitter_link0","doc":"","topic":0,"places":[[]],"kind":{"kind":"random_value","mode":"offset","integer":false},"parameters":[{"name":"offset","unit":"rad","domain":{"kind":"number","low":-0.3,"high":0.3,"shape":"range","integer":false}}],"within":{"start":0.0,"end":65.0},"priority":0,"inclusion":1.0,"constraints":[]},{"name":"jitter_link1","doc":"","topic":1,"places":[[]],"kind":{"kind":"random_value","mode":"offset","integer":false},"parameters":[{"name":"offset","unit":"rad","domain":{"kind":"number","low":-0.3,"high":0.3,"shape":"range","integer":false}}],"within":{"start":0.0,"end":65.0},"priority":0,"inclusion":1.0,"constraints":[]}],"tests":[{"name":"known_jitter","doc":"A strong offset on the lower arm for most of the cycle.","test":{"operations":[{"operation":1,"activation":{"kind":"time","start":8.0,"end":57.0},"parameters":[{"kind":"range","low":0.27,"high":0.29}],"draw_seed":12995400615631193215}]},"expectations":[{"metric":0,"bound":{"kind":"within","low":1.0,"high":40.0}}]},{"name":"jitter_near_zone","doc":"An offset on the column from when the gripper comes near the place where it picks, until the column turns away.","test":{"operations":[{"operation":0,"activation":{"kind":"condition","start":{"compare":{"left":{"variable":6},"by":"below","right":{"number":5.0}}},"end":{"compare":{"left":{"variable":5},"by":"above","right":{"number":1.0}}},"times":1},"parameters":[{"kind":"range","low":0.1,"high":0.2}],"draw_seed":17498918607319784193}]},"expectations":[]},{"name":"jitter_bursts","doc":"A burst on the lower arm each of the first three times that the gripper is deep inside a place near people.","test":{"operations":[{"operation":1,"activation":{"kind":"condition_for","start":{"or":[{"compare":{"left":{"variable":7},"by":"below","right":{"number":0.0}}},{"compare":{"left":{"variable":8},"by":"below","right":{"number":0.0}}}]},"length":2.0,"times":3},"parameters":[{"kind":"range","low":0.27,"high":0.29}],"draw_seed":10990635961636949619}]},"expectations":[]}],"campaign":{"name":"coverage_experiment","doc":"The paper''s experiment: random offsets on the targets of two joints, which may add up.","objectives":[4,0],"operations":[0,1],"count":{"min":1,"max":5},"copies":"may_overlap","activation":{"kind":"time"},"search":{"kind":"nsga2","population":10,"evaluations":3},"coverage":{"axes":[{"dimension":"T1","low":0.0,"high":1.0,"cells":6},{"dimension":"T2","low":0.0,"high":0.5,"cells":6},{"dimension":"P1","low":0.0,"high":1.0,"cells":3}],"hits":1,"stop_at":null},"seed":42,"end_after":70.0}}','all tests were evaluated');
CREATE TABLE metrics (
    id              INTEGER PRIMARY KEY,
    name            TEXT NOT NULL,
    unit            TEXT,           -- NULL for a plain number
    direction       TEXT CHECK (direction IN ('maximise', 'minimise')), -- which way is of interest to a tester
    objective       INTEGER,        -- position among the campaign's objectives, from 0; NULL for none
    default_value   REAL            -- value of a run in which it was never set
) STRICT;
INSERT INTO metrics VALUES(0,'collision_occurrence',NULL,'maximise',1,0.0);
INSERT INTO metrics VALUES(1,'top_speed','m/s','maximise',NULL,0.0);
INSERT INTO metrics VALUES(2,'closest_approach','mm','minimise',NULL,5000.0);
INSERT INTO metrics VALUES(3,'cycle_time','s',NULL,NULL,999.0);
INSERT INTO metrics VALUES(4,'fuzzing_time','s','minimise',0,NULL);
INSERT INTO metrics VALUES(5,'link0_low',NULL,NULL,NULL,NULL);
INSERT INTO metrics VALUES(6,'near_zone1',NULL,NULL,NULL,NULL);
INSERT INTO metrics VALUES(7,'near_zone2',NULL,NULL,NULL,NULL);
INSERT INTO metrics VALUES(8,'near_zone3',NULL,NULL,NULL,NULL);
CREATE TABLE requirements (
    id              INTEGER PRIMARY KEY,
    name            TEXT NOT NULL,
    text            TEXT NOT NULL,
    metric          INTEGER NOT NULL REFERENCES metrics,
    low             REAL,
    low_excluded    INTEGER NOT NULL,
    high            REAL,
    high_excluded   INTEGER NOT NULL
) STRICT;
INSERT INTO requirements VALUES(0,'R1','Robots stay out of the safety zones of the operators',0,NULL,0,0.0,0);
INSERT INTO requirements VALUES(1,'R2','Robots move within their speed limit',1,NULL,0,2.0,0);
INSERT INTO requirements VALUES(2,'R3','Robots keep away from each other',2,200.0,0,NULL,0);
INSERT INTO requirements VALUES(3,'R4','The cell completes its cycle in time',3,NULL,0,70.0,0);
CREATE TABLE tests (
    number          INTEGER PRIMARY KEY,
    name            TEXT NOT NULL UNIQUE, -- T and the number
    origin          TEXT NOT NULL CHECK (origin IN ('reference', 'known', 'search')), -- reference: undisturbed
    known_test      TEXT,           -- name of the known test in the .sesame file
    generation      INTEGER,
    simulator_seed  TEXT NOT NULL,
    outcome         TEXT NOT NULL CHECK (outcome IN ('completed', 'void', 'unknown', 'crash', 'timeout')), -- void: no effect
                                    -- unknown: imported, and nobody counted effects
    outcome_detail  TEXT,           -- what is known of a crash
    time_limit_s    REAL,           -- of a timeout, in seconds of wall time
    end_s           REAL NOT NULL,  -- when the run ended
    messages        INTEGER NOT NULL, -- handled by the relay
    duplicate_of    INTEGER REFERENCES tests -- the equal test whose result stands for this one, which was not simulated
) STRICT;
INSERT INTO tests VALUES(0,'T0','reference',NULL,NULL,'1551435403438694263','completed',NULL,NULL,70.0,38501,NULL);
INSERT INTO tests VALUES(1,'T1','search',NULL,0,'1551435403438694263','completed',NULL,NULL,70.0,38501,NULL);
INSERT INTO tests VALUES(2,'T2','search',NULL,0,'1551435403438694263','completed',NULL,NULL,70.0,38500,NULL);
INSERT INTO tests VALUES(3,'T3','search',NULL,0,'1551435403438694263','completed',NULL,NULL,70.0,38500,NULL);
INSERT INTO tests VALUES(4,'T4','reference',NULL,NULL,'1551435403438694263','completed',NULL,NULL,70.0,38501,NULL);
CREATE TABLE original_names (
    test            INTEGER PRIMARY KEY REFERENCES tests,
    name            TEXT NOT NULL
) STRICT;
CREATE TABLE parents (
    test            INTEGER NOT NULL REFERENCES tests,
    position        INTEGER NOT NULL,
    parent          INTEGER NOT NULL, -- number of the parent test
    PRIMARY KEY (test, position)
) STRICT, WITHOUT ROWID;
CREATE TABLE operations (
    test            INTEGER NOT NULL REFERENCES tests,
    position        INTEGER NOT NULL, -- in the test, from 0
    operation       TEXT NOT NULL,
    start_s         REAL,           -- planned; NULL where a condition starts it, and for an operation before the start or after the end
    end_s           REAL,           -- planned, excluded; NULL likewise
    start_condition TEXT,           -- what starts it, in the words of the language; NULL where time does
    end_condition   TEXT,           -- what ends it, likewise; NULL where it has a length
    length_s        REAL,           -- how long each activation by condition is; NULL where a condition ends it
    times           INTEGER,        -- how often at most it is activated by condition; NULL where time starts it
    draw_seed       TEXT NOT NULL,
    seen            INTEGER,        -- messages that reached it while it was active
    changed         INTEGER,
    dropped         INTEGER,
    delayed         INTEGER,        -- held back while it was active
    queued          INTEGER,        -- came while it was not active, and waited behind those it still held
    injected        INTEGER,
    side_effects    INTEGER,
    unheard         INTEGER,        -- changed, dropped, held back or made up where nobody listens: no effect, and in no other count
    first_touch_s   REAL,           -- its first effect
    last_touch_s    REAL,           -- its last effect
    PRIMARY KEY (test, position)
) STRICT, WITHOUT ROWID;
INSERT INTO operations VALUES(1,0,'jitter_link0',23.890612860647053139,54.832755944403281491,NULL,NULL,NULL,NULL,'2243550712962719001',1547,1547,0,0,0,0,0,0,23.899999999999998578,54.820000000000000282);
INSERT INTO operations VALUES(1,1,'jitter_link1',18.717871746099280727,45.070281576346481245,NULL,NULL,NULL,NULL,'809524340990731949',1318,1318,0,0,0,0,0,0,18.719999999999998863,45.060000000000002273);
INSERT INTO operations VALUES(1,2,'jitter_link0',29.035953941286059888,62.292556773096748657,NULL,NULL,NULL,NULL,'6776507057045453026',1663,1663,0,0,0,0,0,0,29.039999999999999147,62.280000000000001136);
INSERT INTO operations VALUES(1,3,'jitter_link1',22.469097534267497451,29.683515168483481261,NULL,NULL,NULL,NULL,'9216102691673794549',361,361,0,0,0,0,0,0,22.480000000000000426,29.679999999999999715);
INSERT INTO operations VALUES(2,0,'jitter_link0',42.968403610216491018,43.469158961106039384,NULL,NULL,NULL,NULL,'14700141832444928120',25,25,0,0,0,0,0,0,42.979999999999996874,43.460000000000000852);
INSERT INTO operations VALUES(2,1,'jitter_link0',47.069989087711682886,52.174502103567128585,NULL,NULL,NULL,NULL,'16053720423869078887',255,255,0,0,0,0,0,0,47.079999999999998295,52.159999999999996588);
INSERT INTO operations VALUES(2,2,'jitter_link1',22.142993073011069781,51.422875312352395839,NULL,NULL,NULL,NULL,'2774663809297317346',1464,1464,0,0,0,0,0,0,22.160000000000000142,51.420000000000001703);
INSERT INTO operations VALUES(2,3,'jitter_link1',48.795344720539581828,51.614222446347255866,NULL,NULL,NULL,NULL,'272944628488238933',141,141,0,0,0,0,0,0,48.799999999999997156,51.600000000000001421);
INSERT INTO operations VALUES(2,4,'jitter_link1',52.523847694101959858,55.939776439899041803,NULL,NULL,NULL,NULL,'14546835131255061311',170,170,0,0,0,0,0,0,52.539999999999999146,55.920000000000001706);
INSERT INTO operations VALUES(3,0,'jitter_link0',36.8356851058164807,58.366547640579604207,NULL,NULL,NULL,NULL,'11207776671578697778',1077,1077,0,0,0,0,0,0,36.84000000000000341,58.359999999999999432);
INSERT INTO operations VALUES(3,1,'jitter_link1',18.919258395953981732,59.647490411428123026,NULL,NULL,NULL,NULL,'6812614544114431603',2037,2037,0,0,0,0,0,0,18.920000000000001705,59.640000000000000569);
INSERT INTO operations VALUES(3,2,'jitter_link0',42.319942242155974554,53.280939266292058676,NULL,NULL,NULL,NULL,'16595082050359138240',549,549,0,0,0,0,0,0,42.320000000000000282,53.280000000000001135);
CREATE TABLE choices (
    test            INTEGER NOT NULL REFERENCES tests,
    operation       INTEGER NOT NULL, -- position of the operation in the test
    position        INTEGER NOT NULL,
    parameter       TEXT NOT NULL,
    unit            TEXT,           -- NULL for probabilities and plain numbers
    value           REAL,
    low             REAL,
    high            REAL,
    x               REAL,           -- a point has x, y and z
    y               REAL,
    z               REAL,
    text            TEXT,           -- a text, or the path of a file
    PRIMARY KEY (test, operation, position)
) STRICT, WITHOUT ROWID;
INSERT INTO choices VALUES(1,0,0,'offset','rad',NULL,-0.20623600559260707454,0.052997197481388771955,NULL,NULL,NULL,NULL);
INSERT INTO choices VALUES(1,1,0,'offset','rad',NULL,-0.10433512153728602411,0.082551944249666886488,NULL,NULL,NULL,NULL);
INSERT INTO choices VALUES(1,2,0,'offset','rad',NULL,0.022976920105641451819,0.14294967072634767735,NULL,NULL,NULL,NULL);
INSERT INTO choices VALUES(1,3,0,'offset','rad',NULL,-0.2147495760081277738,-0.12833120219604232659,NULL,NULL,NULL,NULL);
INSERT INTO choices VALUES(2,0,0,'offset','rad',NULL,-0.19014865004765446609,0.26409187441033316057,NULL,NULL,NULL,NULL);
INSERT INTO choices VALUES(2,1,0,'offset','rad',NULL,-0.043928662648044403127,0.10863642587179235532,NULL,NULL,NULL,NULL);
INSERT INTO choices VALUES(2,2,0,'offset','rad',NULL,-0.22943014144801771037,-0.17026663420603982412,NULL,NULL,NULL,NULL);
INSERT INTO choices VALUES(2,3,0,'offset','rad',NULL,-0.11558201138112224326,0.23900430466766459103,NULL,NULL,NULL,NULL);
INSERT INTO choices VALUES(2,4,0,'offset','rad',NULL,-0.26583959541048191033,-0.1297178598596875898,NULL,NULL,NULL,NULL);
INSERT INTO choices VALUES(3,0,0,'offset','rad',NULL,0.031521961157337796688,0.21312201955232865091,NULL,NULL,NULL,NULL);
INSERT INTO choices VALUES(3,1,0,'offset','rad',NULL,-0.2631315882756949942,0.089115221125163054938,NULL,NULL,NULL,NULL);
INSERT INTO choices VALUES(3,2,0,'offset','rad',NULL,-0.12449427019491508816,0.010898030612580378306,NULL,NULL,NULL,NULL);
CREATE TABLE intervals (
    test            INTEGER NOT NULL REFERENCES tests,
    operation       INTEGER NOT NULL, -- position of the operation in the test
    position        INTEGER NOT NULL,
    start_s         REAL NOT NULL,
    end_s           REAL NOT NULL,  -- excluded
    PRIMARY KEY (test, operation, position)
) STRICT, WITHOUT ROWID;
INSERT INTO intervals VALUES(1,0,0,23.890612861000001033,54.832755943999998749);
INSERT INTO intervals VALUES(1,1,0,18.717871746000000143,45.070281575999999292);
INSERT INTO intervals VALUES(1,2,0,29.035953940999998934,62.292556773000001156);
INSERT INTO intervals VALUES(1,3,0,22.469097533999999427,29.683515167999999563);
INSERT INTO intervals VALUES(2,0,0,42.968403610000002858,43.469158960999997988);
INSERT INTO intervals VALUES(2,1,0,47.069989087999999808,52.174502103999998324);
INSERT INTO intervals VALUES(2,2,0,22.142993072999999526,51.422875312000002169);
INSERT INTO intervals VALUES(2,3,0,48.795344720999999309,51.614222445999999424);
INSERT INTO intervals VALUES(2,4,0,52.523847693999996975,55.939776440000002822);
INSERT INTO intervals VALUES(3,0,0,36.835685105999999677,58.366547640999996817);
INSERT INTO intervals VALUES(3,1,0,18.919258396000000033,59.647490410999999708);
INSERT INTO intervals VALUES(3,2,0,42.31994224200000332,53.280939265999997188);
CREATE TABLE tails (
    test            INTEGER NOT NULL REFERENCES tests,
    operation       INTEGER NOT NULL, -- position of the operation in the test
    position        INTEGER NOT NULL,
    start_s         REAL NOT NULL,
    end_s           REAL NOT NULL,  -- excluded
    PRIMARY KEY (test, operation, position)
) STRICT, WITHOUT ROWID;
CREATE TABLE unheard (
    test            INTEGER NOT NULL REFERENCES tests,
    position        INTEGER NOT NULL, -- in the order of declaration
    path            TEXT NOT NULL,
    PRIMARY KEY (test, position)
) STRICT, WITHOUT ROWID;
CREATE TABLE metric_values (
    test            INTEGER NOT NULL REFERENCES tests,
    metric          INTEGER NOT NULL REFERENCES metrics,
    value           REAL,           -- NULL: neither set nor defaulted
    is_set          INTEGER NOT NULL, -- 0: the value is the default
    reach_low       REAL,           -- the least value that it could have had at the end of the run, whatever the rest of a run
                                    -- that broke off had brought; the value itself in a completed run. NULL: there is no least
    reach_high      REAL,           -- the greatest; NULL: there is no greatest
    not_finite_s    REAL,           -- when it first read a number that was not finite; NULL: never
    PRIMARY KEY (test, metric)
) STRICT, WITHOUT ROWID;
INSERT INTO metric_values VALUES(0,0,0.0,0,0.0,0.0,NULL);
INSERT INTO metric_values VALUES(0,1,1.6830917685516995074,1,1.6830917685516995074,1.6830917685516995074,NULL);
INSERT INTO metric_values VALUES(0,2,659.55543977705508498,1,659.55543977705508498,659.55543977705508498,NULL);
INSERT INTO metric_values VALUES(0,3,65.799999999999997158,1,65.799999999999997158,65.799999999999997158,NULL);
INSERT INTO metric_values VALUES(0,4,0.0,1,0.0,0.0,NULL);
INSERT INTO metric_values VALUES(0,5,0.0029609757307095556019,1,0.0029609757307095556019,0.0029609757307095556019,NULL);
INSERT INTO metric_values VALUES(0,6,9.9304740899497669914,1,9.9304740899497669914,9.9304740899497669914,NULL);
INSERT INTO metric_values VALUES(0,7,9.9715361825225397041,1,9.9715361825225397041,9.9715361825225397041,NULL);
INSERT INTO metric_values VALUES(0,8,9.9018138425438309013,1,9.9018138425438309013,9.9018138425438309013,NULL);
INSERT INTO metric_values VALUES(1,0,0.0,0,0.0,0.0,NULL);
INSERT INTO metric_values VALUES(1,1,1.6830917685516995074,1,1.6830917685516995074,1.6830917685516995074,NULL);
INSERT INTO metric_values VALUES(1,2,659.55543977705508498,1,659.55543977705508498,659.55543977705508498,NULL);
INSERT INTO metric_values VALUES(1,3,67.439999999999997726,1,67.439999999999997726,67.439999999999997726,NULL);
INSERT INTO metric_values VALUES(1,4,97.765573379000002777,1,97.765573379000002777,97.765573379000002777,NULL);
INSERT INTO metric_values VALUES(1,5,0.0029609757307095556019,1,0.0029609757307095556019,0.0029609757307095556019,NULL);
INSERT INTO metric_values VALUES(1,6,9.8457442231226650619,1,9.8457442231226650619,9.8457442231226650619,NULL);
INSERT INTO metric_values VALUES(1,7,9.9715361825225397041,1,9.9715361825225397041,9.9715361825225397041,NULL);
INSERT INTO metric_values VALUES(1,8,9.9018138425438309013,1,9.9018138425438309013,9.9018138425438309013,NULL);
INSERT INTO metric_values VALUES(2,0,0.0,0,0.0,0.0,NULL);
INSERT INTO metric_values VALUES(2,1,1.6830917685516995074,1,1.6830917685516995074,1.6830917685516995074,NULL);
INSERT INTO metric_values VALUES(2,2,659.55543977705508498,1,659.55543977705508498,659.55543977705508498,NULL);
INSERT INTO metric_values VALUES(2,3,999.0,0,999.0,999.0,NULL);
INSERT INTO metric_values VALUES(2,4,41.119957077000002243,1,41.119957077000002243,41.119957077000002243,NULL);
INSERT INTO metric_values VALUES(2,5,0.0029609757307095556019,1,0.0029609757307095556019,0.0029609757307095556019,NULL);
INSERT INTO metric_values VALUES(2,6,9.9524042242466581598,1,9.9524042242466581598,9.9524042242466581598,NULL);
INSERT INTO metric_values VALUES(2,7,9.9715361825225397041,1,9.9715361825225397041,9.9715361825225397041,NULL);
INSERT INTO metric_values VALUES(2,8,9.9984700096922018985,1,9.9984700096922018985,9.9984700096922018985,NULL);
INSERT INTO metric_values VALUES(3,0,0.0,0,0.0,0.0,NULL);
INSERT INTO metric_values VALUES(3,1,1.6830917685516995074,1,1.6830917685516995074,1.6830917685516995074,NULL);
INSERT INTO metric_values VALUES(3,2,659.55543977705508498,1,659.55543977705508498,659.55543977705508498,NULL);
INSERT INTO metric_values VALUES(3,3,999.0,0,999.0,999.0,NULL);
INSERT INTO metric_values VALUES(3,4,73.22009157399999424,1,73.22009157399999424,73.22009157399999424,NULL);
INSERT INTO metric_values VALUES(3,5,0.0029609757307095556019,1,0.0029609757307095556019,0.0029609757307095556019,NULL);
INSERT INTO metric_values VALUES(3,6,9.8722732806258601812,1,9.8722732806258601812,9.8722732806258601812,NULL);
INSERT INTO metric_values VALUES(3,7,9.9715361825225397041,1,9.9715361825225397041,9.9715361825225397041,NULL);
INSERT INTO metric_values VALUES(3,8,9.9819762445548789742,1,9.9819762445548789742,9.9819762445548789742,NULL);
INSERT INTO metric_values VALUES(4,0,0.0,0,0.0,0.0,NULL);
INSERT INTO metric_values VALUES(4,1,1.6830917685516995074,1,1.6830917685516995074,1.6830917685516995074,NULL);
INSERT INTO metric_values VALUES(4,2,659.55543977705508498,1,659.55543977705508498,659.55543977705508498,NULL);
INSERT INTO metric_values VALUES(4,3,65.799999999999997158,1,65.799999999999997158,65.799999999999997158,NULL);
INSERT INTO metric_values VALUES(4,4,0.0,1,0.0,0.0,NULL);
INSERT INTO metric_values VALUES(4,5,0.0029609757307095556019,1,0.0029609757307095556019,0.0029609757307095556019,NULL);
INSERT INTO metric_values VALUES(4,6,9.9304740899497669914,1,9.9304740899497669914,9.9304740899497669914,NULL);
INSERT INTO metric_values VALUES(4,7,9.9715361825225397041,1,9.9715361825225397041,9.9715361825225397041,NULL);
INSERT INTO metric_values VALUES(4,8,9.9018138425438309013,1,9.9018138425438309013,9.9018138425438309013,NULL);
CREATE TABLE change_points (
    test            INTEGER NOT NULL REFERENCES tests,
    metric          INTEGER NOT NULL REFERENCES metrics,
    position        INTEGER NOT NULL,
    time_s          REAL NOT NULL,
    value           REAL NOT NULL,
    PRIMARY KEY (test, metric, position)
) STRICT, WITHOUT ROWID;
INSERT INTO change_points VALUES(0,1,0,0.020000000000000000416,9.2063992629258509852e-07);
INSERT INTO change_points VALUES(0,1,1,0.040000000000000000832,9.7722244112049920766e-06);
INSERT INTO change_points VALUES(0,1,2,0.059999999999999997779,4.631051476427057922e-05);
INSERT INTO change_points VALUES(0,1,3,0.080000000000000001665,0.00014263860916376779421);
INSERT INTO change_points VALUES(0,2,0,0.020000000000000000416,2391.6048107782180522);
INSERT INTO change_points VALUES(0,2,1,1.080000000000000071,2390.7023020842943878);
INSERT INTO change_points VALUES(0,2,2,1.1000000000000000888,2389.4438962389763219);
INSERT INTO change_points VALUES(0,2,3,1.1200000000000001065,2388.1278896743770019);
INSERT INTO change_points VALUES(0,3,0,65.799999999999997158,65.799999999999997158);
INSERT INTO change_points VALUES(0,4,0,0.0,0.0);
INSERT INTO change_points VALUES(0,5,0,39.579999999999998295,0.072578071465028440312);
INSERT INTO change_points VALUES(0,5,1,39.600000000000001421,0.15382947541521629908);
INSERT INTO change_points VALUES(0,5,2,39.619999999999997442,0.23339132524335426399);
INSERT INTO change_points VALUES(0,5,3,39.640000000000000569,0.31125761875416996238);
INSERT INTO change_points VALUES(0,6,0,22.739999999999998437,9.6350025707053958967);
INSERT INTO change_points VALUES(0,6,1,22.760000000000001562,9.070276764084999499);
INSERT INTO change_points VALUES(0,6,2,22.780000000000001137,8.5065716511645046438);
INSERT INTO change_points VALUES(0,6,3,22.80000000000000071,7.9440343177063210688);
INSERT INTO change_points VALUES(0,7,0,9.3599999999999994315,9.8822508161941566839);
INSERT INTO change_points VALUES(0,7,1,9.3800000000000007815,9.5284583882858324699);
INSERT INTO change_points VALUES(0,7,2,9.4000000000000003552,9.1709044619394699537);
INSERT INTO change_points VALUES(0,7,3,9.4199999999999999289,8.8099715722012881258);
INSERT INTO change_points VALUES(0,8,0,45.25999999999999801,9.9093270481944966121);
INSERT INTO change_points VALUES(0,8,1,45.280000000000001137,9.5563126792856607494);
INSERT INTO change_points VALUES(0,8,2,45.299999999999997156,9.1995535840344935252);
INSERT INTO change_points VALUES(0,8,3,45.320000000000000284,8.8394117969805368062);
INSERT INTO change_points VALUES(1,1,0,0.020000000000000000416,9.2063992629258509852e-07);
INSERT INTO change_points VALUES(1,1,1,0.040000000000000000832,9.7722244112049920766e-06);
INSERT INTO change_points VALUES(1,1,2,0.059999999999999997779,4.631051476427057922e-05);
INSERT INTO change_points VALUES(1,1,3,0.080000000000000001665,0.00014263860916376779421);
INSERT INTO change_points VALUES(1,2,0,0.020000000000000000416,2391.6048107782180522);
INSERT INTO change_points VALUES(1,2,1,1.080000000000000071,2390.7023020842943878);
INSERT INTO change_points VALUES(1,2,2,1.1000000000000000888,2389.4438962389763219);
INSERT INTO change_points VALUES(1,2,3,1.1200000000000001065,2388.1278896743770019);
INSERT INTO change_points VALUES(1,3,0,67.439999999999997726,67.439999999999997726);
INSERT INTO change_points VALUES(1,4,0,0.0,0.0);
INSERT INTO change_points VALUES(1,4,1,29.683515167999999563,7.2144176340000001346);
INSERT INTO change_points VALUES(1,4,2,45.070281575999999292,33.566827463999999281);
INSERT INTO change_points VALUES(1,4,3,54.832755943999998749,64.508970547000004103);
INSERT INTO change_points VALUES(1,5,0,41.079999999999998296,0.072578071465028440312);
INSERT INTO change_points VALUES(1,5,1,41.100000000000001419,0.15382947541521629908);
INSERT INTO change_points VALUES(1,5,2,41.119999999999997442,0.23339132524335426399);
INSERT INTO change_points VALUES(1,5,3,41.14000000000000057,0.31125761875416996238);
INSERT INTO change_points VALUES(1,6,0,22.739999999999998437,9.5998011876419848675);
INSERT INTO change_points VALUES(1,6,1,22.760000000000001562,9.0898998884568555922);
INSERT INTO change_points VALUES(1,6,2,22.780000000000001137,8.5886582499271657553);
INSERT INTO change_points VALUES(1,6,3,22.80000000000000071,8.0950913818324679027);
INSERT INTO change_points VALUES(1,7,0,9.3599999999999994315,9.8822508161941566839);
INSERT INTO change_points VALUES(1,7,1,9.3800000000000007815,9.5284583882858324699);
INSERT INTO change_points VALUES(1,7,2,9.4000000000000003552,9.1709044619394699537);
INSERT INTO change_points VALUES(1,7,3,9.4199999999999999289,8.8099715722012881258);
INSERT INTO change_points VALUES(1,8,0,46.759999999999998011,9.9093270482343704941);
INSERT INTO change_points VALUES(1,8,1,46.780000000000001138,9.5563126793148676085);
INSERT INTO change_points VALUES(1,8,2,46.799999999999997157,9.1995535840559110596);
INSERT INTO change_points VALUES(1,8,3,46.820000000000000285,8.8394117969962273662);
INSERT INTO change_points VALUES(2,1,0,0.020000000000000000416,9.2063992629258509852e-07);
INSERT INTO change_points VALUES(2,1,1,0.040000000000000000832,9.7722244112049920766e-06);
INSERT INTO change_points VALUES(2,1,2,0.059999999999999997779,4.631051476427057922e-05);
INSERT INTO change_points VALUES(2,1,3,0.080000000000000001665,0.00014263860916376779421);
INSERT INTO change_points VALUES(2,2,0,0.020000000000000000416,2391.6048107782180522);
INSERT INTO change_points VALUES(2,2,1,1.080000000000000071,2390.7023020842943878);
INSERT INTO change_points VALUES(2,2,2,1.1000000000000000888,2389.4438962389763219);
INSERT INTO change_points VALUES(2,2,3,1.1200000000000001065,2388.1278896743770019);
INSERT INTO change_points VALUES(2,4,0,0.0,0.0);
INSERT INTO change_points VALUES(2,4,1,43.469158960999997988,0.5007553510000000152);
INSERT INTO change_points VALUES(2,4,2,51.422875312000002169,29.780637590000001324);
INSERT INTO change_points VALUES(2,4,3,51.614222445999999424,32.599515314999997883);
INSERT INTO change_points VALUES(2,5,0,42.579999999999998292,0.072578071465028440312);
INSERT INTO change_points VALUES(2,5,1,42.60000000000000142,0.15382947541521629908);
INSERT INTO change_points VALUES(2,5,2,42.619999999999997443,0.23339132524335426399);
INSERT INTO change_points VALUES(2,5,3,42.640000000000000566,0.31125761875416996238);
INSERT INTO change_points VALUES(2,6,0,22.739999999999998437,9.7333975199110795983);
INSERT INTO change_points VALUES(2,6,1,22.760000000000001562,9.2110899340158187698);
INSERT INTO change_points VALUES(2,6,2,22.780000000000001137,8.6910009876148155427);
INSERT INTO change_points VALUES(2,6,3,22.80000000000000071,8.1764152814016313186);
INSERT INTO change_points VALUES(2,7,0,9.3599999999999994315,9.8822508161941566839);
INSERT INTO change_points VALUES(2,7,1,9.3800000000000007815,9.5284583882858324699);
INSERT INTO change_points VALUES(2,7,2,9.4000000000000003552,9.1709044619394699537);
INSERT INTO change_points VALUES(2,7,3,9.4199999999999999289,8.8099715722012881258);
INSERT INTO change_points VALUES(2,8,0,48.979999999999996873,9.7368706105218230106);
INSERT INTO change_points VALUES(2,8,1,49.0,9.373564701049046377);
INSERT INTO change_points VALUES(2,8,2,49.020000000000003128,8.924619171585035815);
INSERT INTO change_points VALUES(2,8,3,49.039999999999999147,8.3873620854444048688);
INSERT INTO change_points VALUES(3,1,0,0.020000000000000000416,9.2063992629258509852e-07);
INSERT INTO change_points VALUES(3,1,1,0.040000000000000000832,9.7722244112049920766e-06);
INSERT INTO change_points VALUES(3,1,2,0.059999999999999997779,4.631051476427057922e-05);
INSERT INTO change_points VALUES(3,1,3,0.080000000000000001665,0.00014263860916376779421);
INSERT INTO change_points VALUES(3,2,0,0.020000000000000000416,2391.6048107782180522);
INSERT INTO change_points VALUES(3,2,1,1.080000000000000071,2390.7023020842943878);
INSERT INTO change_points VALUES(3,2,2,1.1000000000000000888,2389.4438962389763219);
INSERT INTO change_points VALUES(3,2,3,1.1200000000000001065,2388.1278896743770019);
INSERT INTO change_points VALUES(3,4,0,0.0,0.0);
INSERT INTO change_points VALUES(3,4,1,53.280939265999997188,10.9609970239999992);
INSERT INTO change_points VALUES(3,4,2,58.366547640999996817,32.491859558999998114);
INSERT INTO change_points VALUES(3,4,3,59.647490410999999708,73.22009157399999424);
INSERT INTO change_points VALUES(3,5,0,42.579999999999998292,0.072578071465028440312);
INSERT INTO change_points VALUES(3,5,1,42.60000000000000142,0.15382947541521629908);
INSERT INTO change_points VALUES(3,5,2,42.619999999999997443,0.23339132524335426399);
INSERT INTO change_points VALUES(3,5,3,42.640000000000000566,0.31125761875416996238);
INSERT INTO change_points VALUES(3,6,0,22.739999999999998437,9.5811872068252625922);
INSERT INTO change_points VALUES(3,6,1,22.760000000000001562,9.0325372000882335754);
INSERT INTO change_points VALUES(3,6,2,22.780000000000001137,8.4815677848871420252);
INSERT INTO change_points VALUES(3,6,3,22.80000000000000071,7.9287381298405437135);
INSERT INTO change_points VALUES(3,7,0,9.3599999999999994315,9.8822508161941566839);
INSERT INTO change_points VALUES(3,7,1,9.3800000000000007815,9.5284583882858324699);
INSERT INTO change_points VALUES(3,7,2,9.4000000000000003552,9.1709044619394699537);
INSERT INTO change_points VALUES(3,7,3,9.4199999999999999289,8.8099715722012881258);
INSERT INTO change_points VALUES(3,8,0,48.780000000000001136,9.6098077918366691108);
INSERT INTO change_points VALUES(3,8,1,48.799999999999997156,8.915179239154987556);
INSERT INTO change_points VALUES(3,8,2,48.820000000000000283,8.1395453812999623011);
INSERT INTO change_points VALUES(3,8,3,48.84000000000000341,7.2788325649604947997);
INSERT INTO change_points VALUES(4,1,0,0.020000000000000000416,9.2063992629258509852e-07);
INSERT INTO change_points VALUES(4,1,1,0.040000000000000000832,9.7722244112049920766e-06);
INSERT INTO change_points VALUES(4,1,2,0.059999999999999997779,4.631051476427057922e-05);
INSERT INTO change_points VALUES(4,1,3,0.080000000000000001665,0.00014263860916376779421);
INSERT INTO change_points VALUES(4,2,0,0.020000000000000000416,2391.6048107782180522);
INSERT INTO change_points VALUES(4,2,1,1.080000000000000071,2390.7023020842943878);
INSERT INTO change_points VALUES(4,2,2,1.1000000000000000888,2389.4438962389763219);
INSERT INTO change_points VALUES(4,2,3,1.1200000000000001065,2388.1278896743770019);
INSERT INTO change_points VALUES(4,3,0,65.799999999999997158,65.799999999999997158);
INSERT INTO change_points VALUES(4,4,0,0.0,0.0);
INSERT INTO change_points VALUES(4,5,0,39.579999999999998295,0.072578071465028440312);
INSERT INTO change_points VALUES(4,5,1,39.600000000000001421,0.15382947541521629908);
INSERT INTO change_points VALUES(4,5,2,39.619999999999997442,0.23339132524335426399);
INSERT INTO change_points VALUES(4,5,3,39.640000000000000569,0.31125761875416996238);
INSERT INTO change_points VALUES(4,6,0,22.739999999999998437,9.6350025707053958967);
INSERT INTO change_points VALUES(4,6,1,22.760000000000001562,9.070276764084999499);
INSERT INTO change_points VALUES(4,6,2,22.780000000000001137,8.5065716511645046438);
INSERT INTO change_points VALUES(4,6,3,22.80000000000000071,7.9440343177063210688);
INSERT INTO change_points VALUES(4,7,0,9.3599999999999994315,9.8822508161941566839);
INSERT INTO change_points VALUES(4,7,1,9.3800000000000007815,9.5284583882858324699);
INSERT INTO change_points VALUES(4,7,2,9.4000000000000003552,9.1709044619394699537);
INSERT INTO change_points VALUES(4,7,3,9.4199999999999999289,8.8099715722012881258);
INSERT INTO change_points VALUES(4,8,0,45.25999999999999801,9.9093270481944966121);
INSERT INTO change_points VALUES(4,8,1,45.280000000000001137,9.5563126792856607494);
INSERT INTO change_points VALUES(4,8,2,45.299999999999997156,9.1995535840344935252);
INSERT INTO change_points VALUES(4,8,3,45.320000000000000284,8.8394117969805368062);
CREATE TABLE repetitions (
    test            INTEGER NOT NULL REFERENCES tests,
    position        INTEGER NOT NULL, -- among the repetitions of its test, from 1
    simulator_seed  TEXT NOT NULL,
    outcome         TEXT NOT NULL CHECK (outcome IN ('completed', 'void', 'crash', 'timeout')),
    outcome_detail  TEXT,           -- what is known of a crash
    time_limit_s    REAL,           -- of a timeout, in seconds of wall time
    end_s           REAL NOT NULL,  -- when the run ended
    messages        INTEGER NOT NULL, -- handled by the relay
    PRIMARY KEY (test, position)
) STRICT, WITHOUT ROWID;
CREATE TABLE repetition_values (
    test            INTEGER NOT NULL REFERENCES tests,
    position        INTEGER NOT NULL, -- of the repetition
    metric          INTEGER NOT NULL REFERENCES metrics,
    value           REAL,           -- NULL: neither set nor defaulted
    is_set          INTEGER NOT NULL, -- 0: the value is the default
    reach_low       REAL,           -- the least value that it could have had at the end of the run, whatever the rest of a run
                                    -- that broke off had brought; the value itself in a completed run. NULL: there is no least
    reach_high      REAL,           -- the greatest; NULL: there is no greatest
    not_finite_s    REAL,           -- when it first read a number that was not finite; NULL: never
    PRIMARY KEY (test, position, metric)
) STRICT, WITHOUT ROWID;
CREATE TABLE result_sets (
    name            TEXT PRIMARY KEY,
    generation      INTEGER,
    status          TEXT NOT NULL CHECK (status IN ('intermediate', 'final'))
) STRICT;
INSERT INTO result_sets VALUES('generation-0',0,'intermediate');
INSERT INTO result_sets VALUES('final',NULL,'final');
CREATE TABLE result_set_members (
    result_set      TEXT NOT NULL REFERENCES result_sets,
    position        INTEGER NOT NULL,
    test            INTEGER NOT NULL, -- number of the test
    PRIMARY KEY (result_set, position)
) STRICT, WITHOUT ROWID;
INSERT INTO result_set_members VALUES('final',0,2);
INSERT INTO result_set_members VALUES('generation-0',0,2);
CREATE TABLE coverage (
    generation      INTEGER PRIMARY KEY,
    evaluations     INTEGER NOT NULL, -- tests evaluated by then
    covered         INTEGER NOT NULL, -- cells that enough tests have hit
    cells           INTEGER NOT NULL,
    feasible        INTEGER NOT NULL  -- cells that a test can reach, as far as known, or has hit
) STRICT;
INSERT INTO coverage VALUES(0,3,3,108,96);
CREATE TABLE indicators (
    generation      INTEGER PRIMARY KEY,
    evaluations     INTEGER NOT NULL, -- tests evaluated by then
    unique_tests    INTEGER NOT NULL, -- of these, no exact duplicates of an earlier one
    void            INTEGER NOT NULL, -- of these, without effect
    crashes         INTEGER NOT NULL,
    timeouts        INTEGER NOT NULL,
    front           INTEGER NOT NULL, -- tests on the front
    hypervolume     REAL,           -- of the front up to the reference point; NULL without objectives, before anything was
                                    -- measured, and where the front has no end
    estimated       INTEGER NOT NULL CHECK (estimated IN (0, 1)), -- 1: an exact hypervolume would have taken too long
    standard_error  REAL            -- of an estimated hypervolume
) STRICT;
INSERT INTO indicators VALUES(0,3,3,0,0,0,1,0.0,0,NULL);
CREATE TABLE reference_point (
    objective       INTEGER PRIMARY KEY, -- position among the campaign's objectives, from 0
    metric          INTEGER NOT NULL REFERENCES metrics,
    value           REAL NOT NULL   -- in the metric's unit
) STRICT;
INSERT INTO reference_point VALUES(0,4,146.64836006850001126);
INSERT INTO reference_point VALUES(1,0,0.0);
CREATE TABLE events (
    id              INTEGER PRIMARY KEY,
    kind            TEXT NOT NULL CHECK (kind IN ('warning', 'session')),
    test            INTEGER,        -- NULL: of the campaign
    position        INTEGER NOT NULL, -- among the events of its test
    text            TEXT NOT NULL
) STRICT;
CREATE TABLE sessions (
    id              INTEGER PRIMARY KEY,
    started_at      REAL NOT NULL,  -- wall time, seconds since 1970 UTC
    ended_at        REAL,           -- the same; NULL: still running, or killed
    host            TEXT,
    pid             INTEGER NOT NULL,
    workers         INTEGER NOT NULL
) STRICT;
INSERT INTO sessions VALUES(1,1.0,2.0,'host',1,1);
CREATE TABLE wall_times (
    test            INTEGER PRIMARY KEY REFERENCES tests,
    run_s           REAL NOT NULL   -- wall time of the run as its worker saw it
) STRICT;
INSERT INTO wall_times VALUES(0,0.5);
INSERT INTO wall_times VALUES(1,0.5);
INSERT INTO wall_times VALUES(2,0.5);
INSERT INTO wall_times VALUES(3,0.5);
INSERT INTO wall_times VALUES(4,0.5);
CREATE VIEW first_verdicts AS
    SELECT t.number AS test, t.name AS test_name, r.name AS requirement, r.text AS requirement_text, v.value AS value,
           CASE
               WHEN v.reach_high < r.low OR v.reach_low > r.high OR (r.low_excluded AND v.reach_high = r.low)
                    OR (r.high_excluded AND v.reach_low = r.high) THEN 'violated'
               WHEN v.value IS NULL OR v.not_finite_s IS NOT NULL OR t.outcome NOT IN ('completed', 'void', 'unknown')
                    THEN 'unsaid'
               WHEN v.value < r.low OR v.value > r.high OR (r.low_excluded AND v.value = r.low)
                    OR (r.high_excluded AND v.value = r.high) THEN 'unsaid'
               ELSE 'kept'
           END AS verdict
      FROM tests t CROSS JOIN requirements r LEFT JOIN metric_values v ON v.test = t.number AND v.metric = r.metric;
CREATE VIEW repetition_verdicts AS
    SELECT n.test AS test, n.position AS position, r.name AS requirement, v.value AS value,
           CASE
               WHEN v.reach_high < r.low OR v.reach_low > r.high OR (r.low_excluded AND v.reach_high = r.low)
                    OR (r.high_excluded AND v.reach_low = r.high) THEN 'violated'
               WHEN v.value IS NULL OR v.not_finite_s IS NOT NULL OR n.outcome NOT IN ('completed', 'void')
                    THEN 'unsaid'
               WHEN v.value < r.low OR v.value > r.high OR (r.low_excluded AND v.value = r.low)
                    OR (r.high_excluded AND v.value = r.high) THEN 'unsaid'
               ELSE 'kept'
           END AS verdict
      FROM repetitions n CROSS JOIN requirements r
           LEFT JOIN repetition_values v ON v.test = n.test AND v.position = n.position AND v.metric = r.metric;
CREATE VIEW verdicts AS
    SELECT f.test AS test, f.test_name AS test_name, f.requirement AS requirement, f.requirement_text AS requirement_text,
           f.value AS value,
           CASE
               WHEN EXISTS (SELECT 1 FROM repetition_verdicts n WHERE n.test = coalesce(t.duplicate_of, t.number)
                               AND n.requirement = f.requirement AND n.verdict = 'violated') THEN 'violated'
               WHEN EXISTS (SELECT 1 FROM repetition_verdicts n WHERE n.test = coalesce(t.duplicate_of, t.number)
                               AND n.requirement = f.requirement AND n.verdict = 'kept') THEN 'kept'
               WHEN f.verdict = 'kept'
                    AND EXISTS (SELECT 1 FROM repetitions n WHERE n.test = coalesce(t.duplicate_of, t.number)) THEN 'unsaid'
               ELSE f.verdict
           END AS verdict
      FROM first_verdicts f JOIN tests t ON t.number = f.test JOIN requirements r ON r.name = f.requirement
     ORDER BY t.number, r.id;
CREATE VIEW findings AS
    SELECT v.test, v.test_name, 'violation' AS finding, v.requirement, v.value, v.requirement_text AS detail
      FROM verdicts v JOIN tests t ON t.number = v.test
     WHERE v.verdict = 'violated' AND t.duplicate_of IS NULL
    UNION ALL
    SELECT t.number, t.name, t.outcome, NULL, NULL, t.outcome_detail
      FROM tests t
     WHERE t.outcome IN ('crash', 'timeout') AND t.duplicate_of IS NULL
       AND (NOT EXISTS (SELECT 1 FROM repetitions n WHERE n.test = t.number)
            OR EXISTS (SELECT 1 FROM repetitions n WHERE n.test = t.number AND n.outcome = t.outcome))
    UNION ALL
    SELECT t.number, t.name, n.outcome, NULL, NULL, n.outcome_detail
      FROM repetitions n JOIN tests t ON t.number = n.test
     WHERE n.outcome IN ('crash', 'timeout') AND n.outcome <> t.outcome AND t.duplicate_of IS NULL
       AND n.position = (SELECT min(m.position) FROM repetitions m WHERE m.test = n.test AND m.outcome = n.outcome)
    UNION ALL
    SELECT t.number, t.name, 'not_finite', NULL, v.not_finite_s, 'read by ' || m.name
      FROM metric_values v JOIN tests t ON t.number = v.test JOIN metrics m ON m.id = v.metric
     WHERE v.not_finite_s IS NOT NULL AND t.duplicate_of IS NULL
     ORDER BY 1, 3, 4;
CREATE VIEW confirmations AS
    SELECT f.test AS test, f.test_name AS test_name, f.requirement AS requirement, f.verdict AS first,
           count(*) FILTER (WHERE n.verdict = 'violated') AS confirmed,
           count(*) FILTER (WHERE n.verdict <> 'unsaid') AS said, count(*) AS repetitions
      FROM repetition_verdicts n JOIN first_verdicts f ON f.test = n.test AND f.requirement = n.requirement
           JOIN requirements r ON r.name = f.requirement
     GROUP BY f.test, r.id
    HAVING f.verdict = 'violated' OR count(*) FILTER (WHERE n.verdict = 'violated') > 0
     ORDER BY f.test, r.id;
CREATE VIEW series AS
    SELECT t.number AS test, t.name AS test_name, m.name AS metric, m.unit AS unit, c.position AS position,
           c.time_s AS time_s, c.value AS value
      FROM tests t JOIN change_points c ON c.test = coalesce(t.duplicate_of, t.number) JOIN metrics m ON m.id = c.metric;
CREATE VIEW results AS
    SELECT t.number AS number, t.name AS name, t.origin AS origin, t.known_test AS known_test, t.generation AS generation, t.outcome AS outcome,
           (SELECT value FROM metric_values WHERE test = t.number AND metric = 0) AS "collision_occurrence",
           (SELECT value FROM metric_values WHERE test = t.number AND metric = 1) AS "top_speed",
           (SELECT value FROM metric_values WHERE test = t.number AND metric = 2) AS "closest_approach",
           (SELECT value FROM metric_values WHERE test = t.number AND metric = 3) AS "cycle_time",
           (SELECT value FROM metric_values WHERE test = t.number AND metric = 4) AS "fuzzing_time",
           (SELECT value FROM metric_values WHERE test = t.number AND metric = 5) AS "link0_low",
           (SELECT value FROM metric_values WHERE test = t.number AND metric = 6) AS "near_zone1",
           (SELECT value FROM metric_values WHERE test = t.number AND metric = 7) AS "near_zone2",
           (SELECT value FROM metric_values WHERE test = t.number AND metric = 8) AS "near_zone3"
      FROM tests t ORDER BY t.number;
CREATE VIEW front AS
    SELECT r.* FROM results r JOIN result_set_members m ON m.test = r.number
     WHERE m.result_set = (SELECT name FROM result_sets ORDER BY status = 'final' DESC, generation DESC LIMIT 1)
     ORDER BY r.number;
COMMIT;
PRAGMA application_id = 1397052237;
PRAGMA user_version = 5;
