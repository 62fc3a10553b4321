!> Utility routines by which subroutines of users end the run and write messages.
!!
!! Built into a shared library of its own, which the program and the compiled subroutines both
!! link. The routines have the names and arguments that Abaqus gives them.
module aba_utilities
  use, intrinsic :: iso_c_binding, only: c_char, c_double, c_int, c_size_t
  use, intrinsic :: iso_fortran_env, only: error_unit
  use user_watch, only: end_run
  implicit none
  private

  integer, parameter :: longest = 400

contains

  !> Ends the run: the user's subroutine found no way on.
  subroutine xit() bind(C, name="xit_")
    call end_run("XIT")
  end subroutine xit

  !> The same from an explicit analysis.
  subroutine xplb_exit() bind(C, name="xplb_exit_")
    call end_run("XPLB_EXIT")
  end subroutine xplb_exit

  !> Results of other points and of other parts of a model are not to be had here.
  subroutine getvrm() bind(C, name="getvrm_")
    call refuse("GETVRM")
  end subroutine getvrm

  !> The same from an explicit analysis.
  subroutine vgetvrm() bind(C, name="vgetvrm_")
    call refuse("VGETVRM")
  end subroutine vgetvrm

  subroutine refuse(name)
    character(*), intent(in) :: name

    call write_line("error: "//name//" is called, which is not provided")
    call end_run(name)
  end subroutine refuse

  !> A message of the user's subroutine; LOP = -3 ends the run.
  subroutine stdb_abqerr(lop, text, intv, realv, charv, text_length, charv_length) &
      bind(C, name="stdb_abqerr_")
    integer(c_int), intent(in) :: lop, intv(*)
    real(c_double), intent(in) :: realv(*)
    integer(c_size_t), value :: text_length, charv_length
    character(kind=c_char), intent(in) :: text(text_length), charv(charv_length, *)

    call report("STDB_ABQERR", lop, text, intv, realv, charv_length, charv)
  end subroutine stdb_abqerr

  !> The same from an explicit analysis.
  subroutine xplb_abqerr(lop, text, intv, realv, charv, text_length, charv_length) &
      bind(C, name="xplb_abqerr_")
    integer(c_int), intent(in) :: lop, intv(*)
    real(c_double), intent(in) :: realv(*)
    integer(c_size_t), value :: text_length, charv_length
    character(kind=c_char), intent(in) :: text(text_length), charv(charv_length, *)

    call report("XPLB_ABQERR", lop, text, intv, realv, charv_length, charv)
  end subroutine xplb_abqerr

  !> Write a message of the user's subroutine; LOP = -3 ends the run.
  subroutine report(name, lop, text, intv, realv, charv_length, charv)
    character(*), intent(in) :: name   ! of the routine that was called
    integer(c_size_t), intent(in) :: charv_length
    integer(c_int), intent(in) :: lop, intv(*)
    real(c_double), intent(in) :: realv(*)
    character(kind=c_char), intent(in) :: text(:), charv(charv_length, *)
    character(longest) :: line

    call fill_in(text, intv, realv, charv_length, charv, line)
    call write_line("message of the user's subroutine: "//trim(line))
    if (lop == -3) call end_run(name//" with LOP = -3")
  end subroutine report

  !> Write a line to standard error at once: in a buffer it would be lost in a crash, and stand
  !! behind the words of `end_run`, which use no unit.
  subroutine write_line(text)
    character(*), intent(in) :: text

    write (error_unit, "(a)") "igaform: "//text
    flush (error_unit)
  end subroutine write_line

  !> A text with the next whole number for each %I, real number for %R and word for %S.
  subroutine fill_in(text, intv, realv, charv_length, charv, line)
    integer(c_size_t), intent(in) :: charv_length
    character(kind=c_char), intent(in) :: text(:), charv(charv_length, *)
    integer(c_int), intent(in) :: intv(*)
    real(c_double), intent(in) :: realv(*)
    character(*), intent(out) :: line
    character(24) :: value
    integer :: i, n, used(3)

    line = ""
    used = 0
    n = 0
    i = 1
    do while (i <= size(text))
      value = text(i)
      if (text(i) == "%" .and. i < size(text)) then
        i = i + 1
        select case (text(i))
        case ("I", "i")
          used(1) = used(1) + 1
          write (value, "(i0)") intv(used(1))
        case ("R", "r")
          used(2) = used(2) + 1
          write (value, "(g0.8)") realv(used(2))
        case ("S", "s")
          used(3) = used(3) + 1
          value = word_of(charv(:, used(3)))
        case default
          i = i - 1
        end select
      end if
      line(n + 1:) = value
      n = n + max(1, len_trim(value))
      i = i + 1
    end do
  end subroutine fill_in

  pure function word_of(characters) result(word)
    character(kind=c_char), intent(in) :: characters(:)
    character(24) :: word
    integer :: i

    word = ""
    do i = 1, min(size(characters), len(word))
      word(i:i) = characters(i)
    end do
  end function word_of

end module aba_utilities
