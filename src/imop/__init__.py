"""imop: a robot arm learns a manipulation task from one demonstration, without retraining."""
