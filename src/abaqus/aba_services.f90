!> Utility routines that tell subroutines of users about the run, and locks for their data.
!!
!! The calls carry no argument that says where they come from, so this module remembers the name of
!! the job and keeps the locks.
module aba_services
  use, intrinsic :: iso_c_binding, only: c_char, c_int, c_size_t
  use omp_lib, only: omp_lock_kind, omp_init_lock, omp_set_lock, omp_unset_lock, &
                     omp_get_thread_num, omp_get_max_threads
  implicit none
  private

  integer, parameter :: n_locks = 100, longest = 255
  integer(omp_lock_kind) :: locks(n_locks)
  logical :: is_ready(n_locks) = .false.
  character(longest) :: job = "igaform", folder = "."

contains

  !> Name of the job and folder of its results, for subroutines that ask.
  subroutine set_job(name, name_length, place, place_length) bind(C, name="igaform_set_job")
    integer(c_int), value :: name_length, place_length
    character(kind=c_char), intent(in) :: name(name_length), place(place_length)
    integer :: i

    job = ""
    folder = ""
    do i = 1, min(int(name_length), longest)
      job(i:i) = name(i)
    end do
    do i = 1, min(int(place_length), longest)
      folder(i:i) = place(i)
    end do
  end subroutine set_job

  !> The folder of the results, without a slash at its end.
  subroutine getoutdir(outdir, length, outdir_length) bind(C, name="getoutdir_")
    integer(c_size_t), value :: outdir_length
    character(kind=c_char), intent(out) :: outdir(outdir_length)
    integer(c_int), intent(out) :: length

    call hand_over(folder, outdir, length)
  end subroutine getoutdir

  !> The same from an explicit analysis.
  subroutine vgetoutdir(outdir, length, outdir_length) bind(C, name="vgetoutdir_")
    integer(c_size_t), value :: outdir_length
    character(kind=c_char), intent(out) :: outdir(outdir_length)
    integer(c_int), intent(out) :: length

    call hand_over(folder, outdir, length)
  end subroutine vgetoutdir

  !> The name of the job: that of the result file without its ending.
  subroutine getjobname(name, length, name_length) bind(C, name="getjobname_")
    integer(c_size_t), value :: name_length
    character(kind=c_char), intent(out) :: name(name_length)
    integer(c_int), intent(out) :: length

    call hand_over(job, name, length)
  end subroutine getjobname

  !> The same from an explicit analysis.
  subroutine vgetjobname(name, length, name_length) bind(C, name="vgetjobname_")
    integer(c_size_t), value :: name_length
    character(kind=c_char), intent(out) :: name(name_length)
    integer(c_int), intent(out) :: length

    call hand_over(job, name, length)
  end subroutine vgetjobname

  subroutine hand_over(text, characters, length)
    character(*), intent(in) :: text
    character(kind=c_char), intent(out) :: characters(:)
    integer(c_int), intent(out) :: length
    integer :: i

    characters = " "
    length = min(len_trim(text), size(characters))
    do i = 1, length
      characters(i) = text(i:i)
    end do
  end subroutine hand_over

  !> There is one process, of rank 0.
  subroutine getrank(rank) bind(C, name="getrank_")
    integer(c_int), intent(out) :: rank

    rank = 0
  end subroutine getrank

  !> The same from an explicit analysis.
  subroutine vgetrank(rank) bind(C, name="vgetrank_")
    integer(c_int), intent(out) :: rank

    rank = 0
  end subroutine vgetrank

  !> Number of processes, not of threads.
  subroutine getnumcpus(n) bind(C, name="getnumcpus_")
    integer(c_int), intent(out) :: n

    n = 1
  end subroutine getnumcpus

  !> The same from an explicit analysis.
  subroutine vgetnumcpus(n) bind(C, name="vgetnumcpus_")
    integer(c_int), intent(out) :: n

    n = 1
  end subroutine vgetnumcpus

  !> Number of threads that may call the subroutine at once.
  integer(c_int) function getnumthreads() bind(C, name="getnumthreads_")
    getnumthreads = int(omp_get_max_threads(), c_int)
  end function getnumthreads

  !> Number of the calling thread, from 0.
  integer(c_int) function get_thread_id() bind(C, name="get_thread_id_")
    get_thread_id = int(omp_get_thread_num(), c_int)
  end function get_thread_id

  !> Make lock `id` (1 to 100) ready; others are left alone.
  subroutine mutexinit(id) bind(C, name="mutexinit_")
    integer(c_int), intent(in) :: id

    if (id < 1 .or. id > n_locks) return
    !$omp critical (igaform_locks)
    if (.not. is_ready(id)) call omp_init_lock(locks(id))
    is_ready(id) = .true.
    !$omp end critical (igaform_locks)
  end subroutine mutexinit

  !> Wait for a lock and take it. One that is not ready locks nothing.
  subroutine mutexlock(id) bind(C, name="mutexlock_")
    integer(c_int), intent(in) :: id

    if (id < 1 .or. id > n_locks) return
    if (is_ready(id)) call omp_set_lock(locks(id))
  end subroutine mutexlock

  !> Give a lock back.
  subroutine mutexunlock(id) bind(C, name="mutexunlock_")
    integer(c_int), intent(in) :: id

    if (id < 1 .or. id > n_locks) return
    if (is_ready(id)) call omp_unset_lock(locks(id))
  end subroutine mutexunlock

end module aba_services
