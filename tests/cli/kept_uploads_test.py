#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: photos that a daemon has accepted and not placed when it is killed are placed later, by
#   another daemon or by `veduta settle`, and told each; the journal's order gives the same city.
# Method: real daemons on photos of a rendered street, SIGKILL while photos wait; for a kill between
#   a photo's commit and the end of its waiting, the same photo added beside what waits.
# usage: tests/cli/kept_uploads_test.py VEDUTA VEDUTA_STREET
import json
import signal

from city import PHOTO_COUNT, Case, ask, at, main, make_whole, must, new_database, photo, write
from daemon import Daemon


def setUpModule():
    make_whole()


NUMBERS = range(1, PHOTO_COUNT + 1)


def name_of(number):
    return f'photo{number:04}.jpg'


class KeptUploads(Case):
    def accept_many(self, daemon):
        """Far more photos than are placed meanwhile, twice each in other bytes: their names with
        the bytes, and where each is asked after."""
        photos = {name_of(n): photo(n) for n in NUMBERS}
        photos.update({'copy ' + name_of(n): photo(n) + b'\0' for n in NUMBERS})
        uploads = {}
        for i, name in enumerate(photos):
            code, headers, answer = daemon.send(name, photos[name], f'who{i % 3}', waits=False)
            self.assertEqual((code, answer['image']), (202, name), answer)
            uploads[name] = headers['Location']
        return photos, uploads

    def test_accepted_photos_outlive_kills(self):
        db = new_database('accepted')
        daemon = Daemon(db, '--threads', '2')
        photos, uploads = self.accept_many(daemon)
        daemon.stop(signal.SIGKILL)
        self.assertGreater(ask('status', db)['uploads'], 0, 'the kill came too late')
        with Daemon(db, '--threads', '2') as daemon:
            photos['late.jpg'] = photo(1) + b'\0\0'
            self.assertEqual(daemon.send('late.jpg', photos['late.jpg'], 'who1')[0], 201)
            daemon.wait_for_uploads()
            name, where = list(uploads.items())[-1]
            last = json.loads(daemon.ask('GET', where)[2])
            self.assertEqual((last['state'], last['outcome']['image']), ('done', name))
        self.assertEqual(ask('status', db)['images'], len(photos))
        self.assertEqual(must('verify', db), 'sound\n')
        # The journal's order gives the same city, whatever became of the daemon meanwhile.
        must('settle', db)
        by_hand = new_database('replayed')
        for number in range(1, len(photos) + 1):  # in the order in which they were applied
            image = ask('show', db, f'#{number}')
            write(at(image['image']), photos[image['image']])
            must('add', by_hand, '--camera', 'c', '--contributor', image['contributor'],
                 at(image['image']))
        self.assertEqual(must('digest', by_hand), must('digest', db))

    def settled(self, db, photos):
        """The photos that `settle` tells of."""
        lines = must('settle', db).splitlines()
        names = [line.split(maxsplit=1)[1].split(':')[0] for line in lines]
        return [name for name in names if name in photos]

    def test_settle_places_what_waits(self):
        db = new_database('settled')
        daemon = Daemon(db)
        photos, _ = self.accept_many(daemon)
        daemon.stop(signal.SIGKILL)
        left = ask('status', db)['uploads']
        self.assertGreater(left, 0, 'the kill came too late')
        self.assertIn(f'{left} photos wait for their turn', must('status', db))
        self.assertEqual(len(self.settled(db, photos)), left)
        status = ask('status', db)
        self.assertEqual((status['images'], status['uploads']), (len(photos), 0))

    def kill_between(self, name):
        """A database as a kill between a photo's commit and the end of its waiting leaves it: the
        last one of the photos that came in is stored, and waits. All of them, where each is asked
        after, and how many wait."""
        db = new_database(name)
        daemon = Daemon(db)
        photos, uploads = self.accept_many(daemon)
        daemon.stop(signal.SIGKILL)
        left = ask('status', db)['uploads']
        self.assertGreater(left, 0, 'the kill came too late')
        last = list(photos)[-1]
        write(at(last), photos[last])
        added = must('add', db, '--camera', 'c', '--contributor', f'who{(len(photos) - 1) % 3}',
                     at(last))
        self.assertNotIn('duplicate', added)
        self.assertEqual(ask('status', db)['uploads'], left)
        return db, photos, uploads, left

    def test_settle_tells_of_a_photo_that_a_killed_daemon_has_placed(self):
        db, photos, _, left = self.kill_between('killed_between')
        placed = self.settled(db, photos)
        self.assertEqual((len(placed), len(set(placed))), (left, left))
        self.assertIn(list(photos)[-1], placed)
        status = ask('status', db)
        self.assertEqual((status['images'], status['uploads']), (len(photos), 0))

    def test_a_daemon_tells_of_a_photo_that_a_killed_one_has_placed(self):
        db, photos, uploads, _ = self.kill_between('killed_between_too')
        last = list(photos)[-1]
        with Daemon(db) as daemon:
            told = daemon.get(uploads[last])
            self.assertEqual((told['state'], told['outcome']['image']), ('done', last), told)
            self.assertNotEqual(told['outcome']['verdict'], 'duplicate')
            daemon.wait_for_uploads()


if __name__ == '__main__':
    main()
