"""Subscribes by rclpy, without deserialising, and prints number and digest of the samples as JSON.

Exit codes: 0 all samples came; 2 they did not come in time; 3 a sample could not be read (only with `--content`).
"""

import argparse
import hashlib
import json
import sys
import time

import common
import rclpy
from samples import canonical


def main() -> None:
    """Receives as the options say."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    common.add_topic(parser)
    parser.add_argument("--count", type=int, default=100, help="how many samples to wait for (default: 100)")
    parser.add_argument("--content", action="store_true", help="also the digest of the values alone")
    parser.add_argument("--slow", type=float, default=0.0, help="seconds to sleep after each sample: a slow consumer")
    options = parser.parse_args()
    rclpy.init()
    node = rclpy.create_node("peer_subscriber")
    digest, content, sizes = hashlib.sha256(), hashlib.sha256(), []

    def take(raw: bytes) -> None:
        """Counts a sample."""
        digest.update(raw)
        sizes.append(len(raw))
        if options.content:
            try:
                content.update(canonical(options.type, raw))
            except (ValueError, IndexError) as error:
                print(json.dumps({"count": len(sizes), "error": str(error)}))
                sys.exit(3)
        time.sleep(options.slow)

    node.create_subscription(common.message_type(options.type), options.topic, take, common.quality(options), raw=True)
    end = time.monotonic() + options.timeout
    while len(sizes) < options.count and time.monotonic() < end:
        rclpy.spin_once(node, timeout_sec=0.1)
    result = {"count": len(sizes), "bytes": sum(sizes), "digest": digest.hexdigest()}
    if options.content:
        result["content"] = content.hexdigest()
    print(json.dumps(result))
    node.destroy_node()
    rclpy.try_shutdown()
    sys.exit(0 if len(sizes) >= options.count else 2)


if __name__ == "__main__":
    main()
