"""What Python's mcap reads in traces: for each file named, a line of JSON.

Messages are read in the order of their time by the file's index, as viewers do; checksums are verified.
"""

import json
import sys

from mcap.reader import make_reader

for path in sys.argv[1:]:
    topics, deeds, series = {}, {}, {}
    with open(path, "rb") as file:
        reader = make_reader(file, validate_crcs=True)
        before = 0
        for schema, channel, message in reader.iter_messages():
            assert schema.encoding == "jsonschema" and channel.message_encoding == "json"
            assert json.loads(schema.data)["type"] == "object"
            assert message.log_time >= before
            before = message.log_time
            payload = json.loads(message.data)
            role = channel.metadata["sesame_role"]
            if role in ("published", "delivered"):
                counts = topics.setdefault(role, {})
                counts[channel.topic] = counts.get(channel.topic, 0) + 1
            elif role == "operations":
                counts = deeds.setdefault(str(payload["position"]), {})
                counts[payload["did"]] = counts.get(payload["did"], 0) + 1
            else:
                points = series.setdefault(channel.metadata["sesame_name"], [])
                points.append([message.log_time / 1e9, payload["value"]])
        counted = reader.get_summary().statistics.message_count
        run = {metadata.name: metadata.metadata for metadata in reader.iter_metadata()}
    print(json.dumps({"topics": topics, "deeds": deeds, "series": series, "counted": counted,
                      "test": run["sesame"]["test"], "run": run["sesame.run"]}))
