MODULE words
  RECORD CRATE
    num count;
    num weight;
    pose stand;
  ENDRECORD
  PERS tooldata RmpTool:=[TRUE,[[0,0,0],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];
  PERS wobjdata RmpFrame:=[FALSE,TRUE,"",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
  VAR num R_SPEED;
  VAR bool R_TIMEOUT;
  VAR num way{3};
  VAR CRATE box;
  VAR num i;
  VAR num j;
  VAR num n;
  VAR num x2;
  VAR num y2;
  VAR bool found;
  VAR pose p;

  PROC main()
    ConfJ\Off;
    ConfL\Off;
    R_SPEED:=250;
    R_TIMEOUT:=FALSE;
    way{1}:=1.5;
    way{2}:=-2.5;
    way{3}:=0.003;
    box.count:=2;
    box.weight:=4.5;
    box.stand:=[[1,2,3],[0.951548525,0.038134576,0.189307857,0.239298338]];
    i:=0;
    j:=7;
    n:=0;
    x2:=0;
    y2:=0;
    found:=FALSE;
    p:=[[400,0,300],[0.707106781,0,0.707106781,0]];
    i:=3;
    swap i,j;
    x2:=larger(way{1},way{i-6+1})/i;
    y2:=(-(x2))*(x2-(y2-1))+Sin(x2)/2;
    n:=RmpDiv(i+j, 3)+RmpMod(i, 4)-RmpTrunc(x2)+RmpRound(y2);
    found:=(NOT (i=j OR x2<y2 AND found)) XOR i<>3;
    FOR i_i FROM 10 TO 2 STEP 2 DO
      i:=i_i;
      way{2}:=way{2}+i;
    ENDFOR
    FOR i_i2 FROM 5 TO 1 STEP -1 DO
      i:=i_i2;
      IF i=3 THEN
        GOTO loop_end;
      ENDIF
    ENDFOR
    loop_end:
    repeat:
    n:=n-1;
    IF n=5 THEN
      GOTO loop_end2;
    ENDIF
    IF NOT (n<=0) THEN
      GOTO repeat;
    ENDIF
    loop_end2:
    WHILE TRUE DO
      IF DInput(di1)=1 THEN
        GOTO loop_end3;
      ELSEIF GInput(gi4_4)=5 THEN
        n:=1;
      ELSEIF GInput(gi4_4)>9 THEN
        n:=2;
      ELSE
        n:=3;
      ENDIF
    ENDWHILE
    loop_end3:
    TEST n+1
    CASE 1:
      SetDO do2,1;
    CASE 2,3:
      IF NOT (DInput(di1)=1) THEN
        SetDO do2,1;
      ELSE
        SetDO do2,0;
      ENDIF
    DEFAULT:
      SetAO ao3,2.5;
    ENDTEST
    WaitUntil DInput(di1)=1 AND GInput(gi4_4)<>0\MaxTime:=1.5\TimeFlag:=R_TIMEOUT;
    IF R_TIMEOUT THEN
      Stop;
    ENDIF
    box.weight:=box.weight+1;
    p.trans:=[x2,y2,300];
    p.rot:=OrientZYX(30,x2,10);
    box.stand:=PoseMult(p,[[0,0,-50],OrientZYX(0,0,x2)*OrientZYX(0,0,0)*OrientZYX(5,0,0)]);
    p.trans.z:=box.stand.trans.x;
    R_SPEED:=400;
    AccSet 100,100;
    RmpTool.tframe:=[[0,0,0],[1,0,0,0]];
    RmpFrame.uframe:=[[0,0,0],[1,0,0,0]];
    MoveJ RmpTarget(p),[2500,250,5000,1000],fine,RmpTool\WObj:=RmpFrame;
    MoveJ RmpTarget(box.stand),[2500,250,5000,1000],fine,RmpTool\WObj:=RmpFrame;
    AccSet 50,100;
    MoveL RmpTarget(p),[R_SPEED,90,5000,1000],[FALSE,x2,x2*1.5,x2*1.5,x2*0.15,x2*1.5,x2*0.15],RmpTool\WObj:=RmpFrame;
    R_SPEED:=x2;
    AccSet 100,100;
    RmpTool.tframe:=[[0,0,100],[1,0,0,0]];
    MoveL RmpTarget(p),[R_SPEED,90,5000,1000],fine,RmpTool\WObj:=RmpFrame;
    RmpTool.tframe:=[[0,0,0],[1,0,0,0]];
    MoveL RmpTarget(p),[R_SPEED,90,5000,1000],[FALSE,10,15,15,1.5,15,1.5],RmpTool\WObj:=RmpFrame;
    MoveL RmpTarget(box.stand),[R_SPEED,90,5000,1000],[FALSE,10,15,15,1.5,15,1.5],RmpTool\WObj:=RmpFrame;
    MoveL RmpTarget(p),[R_SPEED,90,5000,1000],fine,RmpTool\WObj:=RmpFrame;
    RmpFrame.uframe:=[[10,0,0],[0.707106781,0,0,0.707106781]];
    MoveL RmpTarget(p),[R_SPEED,90,5000,1000],fine,RmpTool\WObj:=RmpFrame;
  ENDPROC

  FUNC num larger(num a,num b)
    IF a>b THEN
      RETURN a;
    ENDIF
    RETURN b;
  ENDFUNC

  PROC swap(INOUT num a2,INOUT num b2)
    VAR num t;
    t:=0;
    t:=a2;
    a2:=b2;
    b2:=t;
  ENDPROC

  LOCAL FUNC robtarget RmpTarget(pose p)
    VAR robtarget t;
    t:=CRobT(\Tool:=RmpTool\WObj:=RmpFrame);
    t.trans:=p.trans;
    t.rot:=p.rot;
    RETURN t;
  ENDFUNC

  LOCAL FUNC num RmpTrunc(num x)
    IF x<0 RETURN -Trunc(-x);
    RETURN Trunc(x);
  ENDFUNC

  LOCAL FUNC num RmpRound(num x)
    IF x<0 RETURN -Trunc(0.5-x);
    RETURN Trunc(x+0.5);
  ENDFUNC

  LOCAL FUNC num RmpDiv(num a,num b)
    RETURN RmpTrunc(a/b);
  ENDFUNC

  LOCAL FUNC num RmpMod(num a,num b)
    RETURN a-b*RmpTrunc(a/b);
  ENDFUNC
ENDMODULE
